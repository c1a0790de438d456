package org.vislam2tag.tools;

import java.time.ZoneId;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.Clocks;

/** The clocks of a scripted phone: the boot clock is set by each call, the others run beside it. */
final class ScriptedClocks implements Clocks {
  private ClockReading base = new ClockReading(0, 0, 0);
  private ZoneId zone = ZoneId.of("UTC");
  private long bootNs;

  /** From {@code reading} on all clocks run alike. */
  void set(ClockReading reading) {
    base = reading;
    bootNs = reading.bootNs;
  }

  void zone(ZoneId id) {
    zone = id;
  }

  /** It is now {@code now} on the boot clock. */
  void boot(long now) {
    bootNs = now;
  }

  /** The boot clock, ns. */
  long boot() {
    return bootNs;
  }

  @Override public ClockReading read() {
    long since = bootNs - base.bootNs;
    return new ClockReading(bootNs, base.nanoNs + since, base.wallMs + since / 1_000_000);
  }

  @Override public ZoneId zone() {
    return zone;
  }
}
