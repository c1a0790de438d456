package org.vislam2tag.core.clock;

/** The phone's three clocks, read together. */
public final class ClockReading {
  /** Nanoseconds since boot, sleep included ({@code elapsedRealtimeNanos}). */
  public final long bootNs;
  /** Nanoseconds of {@code System.nanoTime}, which stands still while the phone sleeps. */
  public final long nanoNs;
  /** Milliseconds since 1970 (UTC) by the wall clock, which may be set at any moment. */
  public final long wallMs;

  public ClockReading(long bootNs, long nanoNs, long wallMs) {
    this.bootNs = bootNs;
    this.nanoNs = nanoNs;
    this.wallMs = wallMs;
  }
}
