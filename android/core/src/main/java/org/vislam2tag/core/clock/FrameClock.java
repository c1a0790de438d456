package org.vislam2tag.core.clock;

/**
 * Brings the stamp of a camera frame to the boot clock. ARCore does not promise the base of {@code Frame.getTimestamp}:
 * it is found anew at each frame, by which clock the stamp is just behind of (docs/reference/phone-tables.md, exposure time).
 */
public enum FrameClock {
  BOOT("boot"), MONOTONIC("monotonic"), UNKNOWN("unknown");

  /** An image is handed to the app within this time of its exposure, ns. */
  static final long MOST_DELAY_NS = 2_000_000_000L;

  /** The clock's name in CameraPose.csv. */
  public final String word;

  FrameClock(String word) {
    this.word = word;
  }

  /** The clock that {@code frameNs} is on, given the clocks when the app got the frame. */
  public static FrameClock of(long frameNs, ClockReading arrival) {
    if (isJustBefore(frameNs, arrival.bootNs)) {
      return BOOT;
    }
    return isJustBefore(frameNs, arrival.nanoNs) ? MONOTONIC : UNKNOWN;
  }

  /** When the image was exposed, ns on the boot clock; the time of arrival where that cannot be known. */
  public long exposedNs(long frameNs, ClockReading arrival) {
    switch (this) {
      case BOOT:
        return frameNs;
      case MONOTONIC:
        return frameNs + (arrival.bootNs - arrival.nanoNs);
      default:
        return arrival.bootNs;
    }
  }

  private static boolean isJustBefore(long stampNs, long nowNs) {
    long delayNs = nowNs - stampNs;
    return delayNs >= 0 && delayNs < MOST_DELAY_NS;
  }
}
