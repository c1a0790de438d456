package org.vislam2tag.core;

import java.time.ZoneId;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.Clocks;

/** Clocks that a test sets; they begin at a boot time of 1000 s, the wall clock at 2021-12-20T13:25:23.417+01:00. */
public final class TestClocks implements Clocks {
  public static final long START_NS = 1_000_000_000_000L;
  public static final long WALL_MS = 1_640_003_123_417L;

  /** Now, on the boot clock. */
  public long bootNs = START_NS;
  /** The phone slept for so long before. */
  public long sleptNs;
  /** The wall clock was set by so much. */
  public long wallSetMs;

  /** Time goes by. */
  public void pass(double seconds) {
    bootNs += Math.round(seconds * 1e9);
  }

  @Override public ClockReading read() {
    return new ClockReading(bootNs, bootNs - sleptNs, WALL_MS + (bootNs - START_NS) / 1_000_000 + wallSetMs);
  }

  @Override public ZoneId zone() {
    return ZoneId.of("Europe/Berlin");
  }
}
