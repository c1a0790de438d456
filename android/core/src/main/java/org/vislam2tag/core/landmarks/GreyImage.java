package org.vislam2tag.core.landmarks;

/** Brightness of an image's pixels, row by row, 0 (black) to 255. */
public final class GreyImage {
  public final int width;
  public final int height;
  private final byte[] pixels;

  public GreyImage(int width, int height, byte[] pixels) {
    if (pixels.length != width * height) {
      throw new IllegalArgumentException(pixels.length + " pixels are not " + width + " x " + height);
    }
    this.width = width;
    this.height = height;
    this.pixels = pixels;
  }

  /** Of colours 0xAARRGGBB, as Android's bitmaps give them; what is transparent is white, as the paper is. */
  public static GreyImage ofColours(int width, int height, int[] colours) {
    byte[] pixels = new byte[colours.length];
    for (int i = 0; i < colours.length; i++) {
      int colour = colours[i];
      int alpha = colour >>> 24;
      int grey = (299 * (colour >> 16 & 0xFF) + 587 * (colour >> 8 & 0xFF) + 114 * (colour & 0xFF)) / 1000;
      pixels[i] = (byte) ((grey * alpha + 255 * (255 - alpha)) / 255);
    }
    return new GreyImage(width, height, pixels);
  }

  /** Brightness at column x of row y. */
  public int at(int x, int y) {
    return pixels[y * width + x] & 0xFF;
  }

  /** The image with its longer side at most {@code longest} pixels; each is the mean of those that it stands for. */
  GreyImage shrunk(int longest) {
    int longer = Math.max(width, height);
    if (longer <= longest) {
      return this;
    }
    int w = Math.max(1, (int) ((long) width * longest / longer));
    int h = Math.max(1, (int) ((long) height * longest / longer));
    byte[] small = new byte[w * h];
    for (int y = 0; y < h; y++) {
      for (int x = 0; x < w; x++) {
        small[y * w + x] = (byte) mean(x * width / w, (x + 1) * width / w, y * height / h, (y + 1) * height / h);
      }
    }
    return new GreyImage(w, h, small);
  }

  private int mean(int x0, int x1, int y0, int y1) {
    long sum = 0;
    for (int y = y0; y < y1; y++) {
      for (int x = x0; x < x1; x++) {
        sum += at(x, y);
      }
    }
    return (int) (sum / ((long) (x1 - x0) * (y1 - y0)));
  }
}
