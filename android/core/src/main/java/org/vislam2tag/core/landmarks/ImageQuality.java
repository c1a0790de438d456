package org.vislam2tag.core.landmarks;

/**
 * Whether an image gives the tracker enough to hold on to: corners (Shi and Tomasi, 1994: both eigenvalues of the
 * gradients' matrix are large) in many places of the sheet, and contrast. ARCore has a measure of its own, which it tells
 * nobody; this one is to name what is surely too plain before a walk.
 */
public final class ImageQuality {
  /** The tracker wants this many pixels on the shorter side. */
  static final int LEAST_PIXELS = 300;
  /** Looked at in this size: about what the camera sees of a sheet from two metres, pixels. */
  static final int LOOKED_AT = 256;
  /** Places: the sheet is cut into this many by this many cells. */
  static final int CELLS = 8;
  /** Standard deviation of the brightness, at least. */
  static final double LEAST_CONTRAST = 20;
  /** Corners in the whole image, at least. */
  static final int LEAST_CORNERS = 60;
  /** Cells with a corner, at least, of 64. */
  static final int LEAST_CELLS = 24;
  /** The smaller eigenvalue of the mean gradient matrix, in grey levels per pixel squared, at least. */
  private static final double LEAST_EIGENVALUE = 60;
  private static final int WINDOW = 2;
  private static final int APART = 3;
  /** Nearer to the image's edge a window is not whole, pixels. */
  private static final int RIM = WINDOW + 1;

  public final int width;
  public final int height;
  /** Standard deviation of the brightness. */
  public final double contrast;
  public final int corners;
  /** Cells with a corner, of 64. */
  public final int cells;

  private ImageQuality(int width, int height, double contrast, int corners, int cells) {
    this.width = width;
    this.height = height;
    this.contrast = contrast;
    this.corners = corners;
    this.cells = cells;
  }

  /** Measures an image. */
  public static ImageQuality of(GreyImage image) {
    GreyImage small = image.shrunk(LOOKED_AT);
    double[] strength = eigenvalues(small);
    int corners = 0;
    boolean[] cells = new boolean[CELLS * CELLS];
    for (int y = RIM; y < small.height - RIM; y++) {
      for (int x = RIM; x < small.width - RIM; x++) {
        if (isCorner(strength, small.width, small.height, x, y)) {
          corners++;
          cells[y * CELLS / small.height * CELLS + x * CELLS / small.width] = true;
        }
      }
    }
    int filled = 0;
    for (boolean cell : cells) {
      filled += cell ? 1 : 0;
    }
    return new ImageQuality(image.width, image.height, contrast(small), corners, filled);
  }

  /** Why the tracker would lose it; null where it is good enough. */
  public Refusal.Reason fault() {
    if (Math.min(width, height) < LEAST_PIXELS) {
      return Refusal.Reason.TOO_SMALL;
    }
    boolean rich = contrast >= LEAST_CONTRAST && corners >= LEAST_CORNERS && cells >= LEAST_CELLS;
    return rich ? null : Refusal.Reason.TOO_PLAIN;
  }

  /** What was measured, for the collector. */
  public String words() {
    return width + " x " + height + " pixels, contrast " + Math.round(contrast) + ", " + corners + " corners in " + cells
        + " of " + CELLS * CELLS + " places";
  }

  private static double contrast(GreyImage image) {
    double sum = 0;
    double squares = 0;
    int n = image.width * image.height;
    for (int y = 0; y < image.height; y++) {
      for (int x = 0; x < image.width; x++) {
        int grey = image.at(x, y);
        sum += grey;
        squares += (double) grey * grey;
      }
    }
    return Math.sqrt(Math.max(0, squares / n - sum / n * (sum / n)));
  }

  /** The largest of its neighbourhood and large enough; of equal ones the first. */
  private static boolean isCorner(double[] strength, int width, int height, int x, int y) {
    double here = strength[y * width + x];
    if (here < LEAST_EIGENVALUE) {
      return false;
    }
    for (int v = Math.max(0, y - APART); v <= Math.min(height - 1, y + APART); v++) {
      for (int u = Math.max(0, x - APART); u <= Math.min(width - 1, x + APART); u++) {
        double there = strength[v * width + u];
        boolean earlier = v < y || v == y && u < x;
        if (there > here || there == here && earlier) {
          return false;
        }
      }
    }
    return true;
  }

  /** The smaller eigenvalue at each pixel; of no meaning at the rim. */
  private static double[] eigenvalues(GreyImage image) {
    int width = image.width;
    double[] xx = new double[width * image.height];
    double[] xy = new double[xx.length];
    double[] yy = new double[xx.length];
    for (int y = 1; y < image.height - 1; y++) {
      for (int x = 1; x < width - 1; x++) {
        double gx = (image.at(x + 1, y) - image.at(x - 1, y)) / 2.0;
        double gy = (image.at(x, y + 1) - image.at(x, y - 1)) / 2.0;
        xx[y * width + x] = gx * gx;
        xy[y * width + x] = gx * gy;
        yy[y * width + x] = gy * gy;
      }
    }
    double[] a = windowMeans(xx, width);
    double[] b = windowMeans(xy, width);
    double[] c = windowMeans(yy, width);
    double[] smaller = new double[xx.length];
    for (int i = 0; i < smaller.length; i++) {
      double half = (a[i] - c[i]) / 2;
      smaller[i] = (a[i] + c[i]) / 2 - Math.sqrt(half * half + b[i] * b[i]);
    }
    return smaller;
  }

  /** Means over the window around each pixel, along rows and then along columns; of no meaning at the rim. */
  private static double[] windowMeans(double[] values, int width) {
    return along(along(values, 1), width);
  }

  private static double[] along(double[] values, int step) {
    double[] means = new double[values.length];
    for (int i = WINDOW * step; i < values.length - WINDOW * step; i++) {
      double sum = 0;
      for (int k = -WINDOW; k <= WINDOW; k++) {
        sum += values[i + k * step];
      }
      means[i] = sum / (2 * WINDOW + 1);
    }
    return means;
  }
}
