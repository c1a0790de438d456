package org.vislam2tag.core.clock;

/** Notices when the wall clock is set while the boot clock runs on. */
public final class WallClockWatch {
  /** Less than this is the network's daily trimming of the clock, ms. */
  static final long LEAST_JUMP_MS = 500;

  private long bootMinusWallMs;

  public WallClockWatch(ClockReading start) {
    bootMinusWallMs = offsetMs(start);
  }

  /** By how many ms, with sign, the wall clock jumped since the last call; 0 where it ran as it should. */
  public long jumpMs(ClockReading now) {
    long offsetMs = offsetMs(now);
    long jumpMs = bootMinusWallMs - offsetMs;
    if (Math.abs(jumpMs) < LEAST_JUMP_MS) {
      return 0;
    }
    bootMinusWallMs = offsetMs;
    return jumpMs;
  }

  private static long offsetMs(ClockReading reading) {
    return reading.bootNs / 1_000_000 - reading.wallMs;
  }
}
