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
    for (int y = 0; y < small.height; y++) {
      for (int x = 0; x < small.width; x++) {
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

  /** The smaller eigenvalue at each pixel; 0 at the rim. */
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
    double[] smaller = new double[xx.length];
    for (int y = WINDOW + 1; y < image.height - WINDOW - 1; y++) {
      for (int x = WINDOW + 1; x < width - WINDOW - 1; x++) {
        double a = mean(xx, width, x, y);
        double b = mean(xy, width, x, y);
        double c = mean(yy, width, x, y);
        smaller[y * width + x] = (a + c) / 2 - Math.sqrt((a - c) * (a - c) / 4 + b * b);
      }
    }
    return smaller;
  }

  private static double mean(double[] values, int width, int x, int y) {
    double sum = 0;
    for (int v = y - WINDOW; v <= y + WINDOW; v++) {
      for (int u = x - WINDOW; u <= x + WINDOW; u++) {
        sum += values[v * width + u];
      }
    }
    return sum / ((2 * WINDOW + 1) * (2 * WINDOW + 1));
  }
}
