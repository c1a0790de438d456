package org.vislam2tag.core.walk;

/** Which part of a floor's plan a screen shows: moved by a finger, enlarged by two. */
public final class PlanFrame {
  /** People are off by so much when they tap where they stand, m (taps of the Indoor Location Competition 2.0: 0.4 to 0.6). */
  static final double PLACING_M = 0.5;
  /** A fingertip hits a place of the screen with this sigma, in Android's dp (1/160 inch). */
  static final double FINGER_DP = 10;
  private static final double MARGIN = 0.04;
  private static final double MOST_ENLARGED = 40;

  private final double leastScale;
  private final double pixelsPerDp;
  /** Pixels of a metre. */
  private double scale;
  /** Pixel of the frame's origin. */
  private double originX;
  private double originY;

  /** Shows a floor from (x0, y0) to (x1, y1), m, whole on a screen of this size, pixels. */
  public PlanFrame(double x0, double y0, double x1, double y1, int width, int height, double pixelsPerDp) {
    this.pixelsPerDp = pixelsPerDp;
    leastScale = (1 - 2 * MARGIN) * Math.min(width / (x1 - x0), height / (y1 - y0));
    scale = leastScale;
    originX = width / 2.0 - scale * (x0 + x1) / 2;
    originY = height / 2.0 + scale * (y0 + y1) / 2;
  }

  /** Moved by so many pixels. */
  public void move(double right, double down) {
    originX += right;
    originY += down;
  }

  /** Enlarged so many times about a pixel, which stays where it is; never smaller than whole. */
  public void enlarge(double times, double x, double y) {
    double wanted = Math.max(leastScale, Math.min(MOST_ENLARGED * leastScale, scale * times));
    originX = x + (originX - x) * wanted / scale;
    originY = y + (originY - y) * wanted / scale;
    scale = wanted;
  }

  /** Pixel of a place. */
  public float x(double xM) {
    return (float) (originX + scale * xM);
  }

  /** Pixels grow downwards, the floor's y up. */
  public float y(double yM) {
    return (float) (originY - scale * yM);
  }

  /** Place of a pixel, m. */
  public double xM(double x) {
    return (x - originX) / scale;
  }

  /** Place of a pixel, m. */
  public double yM(double y) {
    return (originY - y) / scale;
  }

  /** Sigma of a tap along each axis as the plan is shown now, m. */
  public double sigmaM() {
    return Math.hypot(PLACING_M, FINGER_DP * pixelsPerDp / scale);
  }
}
