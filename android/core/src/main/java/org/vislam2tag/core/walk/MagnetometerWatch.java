package org.vislam2tag.core.walk;

/** Whether the magnetometer wants to be calibrated, as the platform says by the accuracy of its readings. */
public final class MagnetometerWatch {
  /** Android's {@code SENSOR_STATUS_ACCURACY_MEDIUM}: from here on readings are good enough. */
  static final int GOOD = 2;

  private boolean low;

  /** Told Android's accuracy, -1 to 3; true where it has become too low, or good again. */
  public boolean changes(int accuracy) {
    boolean before = low;
    low = accuracy < GOOD;
    return low != before;
  }

  /** Should the collector calibrate it? Not before the platform has said so. */
  public boolean isLow() {
    return low;
  }
}
