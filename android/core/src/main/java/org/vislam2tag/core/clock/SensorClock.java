package org.vislam2tag.core.clock;

/**
 * Brings the stamps of one sensor to the boot clock. Which clock they are on is decided at its first reading
 * (docs/reference/phone-tables.md, Sensors.csv).
 */
public final class SensorClock {
  /** A stamp this near to a clock is taken to be on it, ns. */
  static final long NEAR_NS = 10_000_000_000L;

  private enum Base { BOOT, MONOTONIC, UNKNOWN }

  private final Base base;
  private final long offsetNs;

  /** Decides by the stamp of the first reading and the clocks at its arrival. */
  public SensorClock(long firstStampNs, ClockReading arrival) {
    if (isNear(firstStampNs, arrival.bootNs)) {
      base = Base.BOOT;
    } else {
      base = isNear(firstStampNs, arrival.nanoNs) ? Base.MONOTONIC : Base.UNKNOWN;
    }
    offsetNs = base == Base.MONOTONIC ? arrival.bootNs - arrival.nanoNs : 0;
  }

  /** The time of a reading, ns on the boot clock: its arrival's where the stamp's clock is not known. */
  public long bootNs(long stampNs, long arrivedNs) {
    return base == Base.UNKNOWN ? arrivedNs : stampNs + offsetNs;
  }

  /** What the event {@code sensor_clock} says of it: {@code monotonic}, {@code unknown}; null where all is as usual. */
  public String remark() {
    switch (base) {
      case MONOTONIC:
        return "monotonic";
      case UNKNOWN:
        return "unknown";
      default:
        return null;
    }
  }

  private static boolean isNear(long stampNs, long clockNs) {
    return Math.abs(stampNs - clockNs) <= NEAR_NS;
  }
}
