package org.vislam2tag.core.walk;

/** When the screen warns the collector. */
public final class WarningSettings {
  /** So long without a landmark in view, s. */
  public final double noLandmarkS;
  /** Walked so far without a landmark in view, m. */
  public final double noLandmarkM;
  /** Tracking is lost for so long, s. */
  public final double lostS;
  /** Mean speed over a second, m/s. */
  public final double fastestMps;
  /** Mean turning over a second, rad/s. */
  public final double fastestRadps;

  public WarningSettings(double noLandmarkS, double noLandmarkM, double lostS, double fastestMps, double fastestRadps) {
    this.noLandmarkS = noLandmarkS;
    this.noLandmarkM = noLandmarkM;
    this.lostS = lostS;
    this.fastestMps = fastestMps;
    this.fastestRadps = fastestRadps;
  }

  /** Of a walk past landmarks after each turn, at an ordinary pace. */
  public static WarningSettings usual() {
    return new WarningSettings(90, 60, 1, 1.8, 1.6);
  }
}
