package org.vislam2tag.core.session;

import org.vislam2tag.core.walk.WarningSettings;

/** Every threshold of a recording that may be set. */
public final class RecorderSettings {
  public final WarningSettings warnings;
  /** The recording ends by itself when the disk has less left, bytes. */
  public final long stopBytes;
  /** The event {@code storage_low} comes when the disk has less left, bytes. */
  public final long lowBytes;
  /** The event {@code battery_low} comes at this charge, percent. */
  public final int lowBatteryPercent;

  public RecorderSettings(WarningSettings warnings, long stopBytes, long lowBytes, int lowBatteryPercent) {
    this.warnings = warnings;
    this.stopBytes = stopBytes;
    this.lowBytes = lowBytes;
    this.lowBatteryPercent = lowBatteryPercent;
  }

  /** Stops at 64 MB, tells of 512 MB and 15 %. */
  public static RecorderSettings usual() {
    return new RecorderSettings(WarningSettings.usual(), 64L << 20, 512L << 20, 15);
  }
}
