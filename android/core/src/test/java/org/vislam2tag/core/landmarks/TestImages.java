package org.vislam2tag.core.landmarks;

import java.util.Random;

/** Images that a test needs. */
final class TestImages {
  private TestImages() {}

  private interface Shade {
    int at(int x, int y);
  }

  private static GreyImage of(int width, int height, Shade shade) {
    byte[] pixels = new byte[width * height];
    for (int y = 0; y < height; y++) {
      for (int x = 0; x < width; x++) {
        pixels[y * width + x] = (byte) Math.max(0, Math.min(255, shade.at(x, y)));
      }
    }
    return new GreyImage(width, height, pixels);
  }

  /** Nothing but paper. */
  static GreyImage flat(int width, int height) {
    return of(width, height, (x, y) -> 240);
  }

  /** Dark to light: contrast without a corner. */
  static GreyImage ramp(int width, int height) {
    return of(width, height, (x, y) -> 255 * x / width);
  }

  /** Upright bars: edges without corners. */
  static GreyImage bars(int width, int height) {
    return of(width, height, (x, y) -> x / 20 % 2 == 0 ? 20 : 235);
  }

  /** A sign: one dark square on white paper, with four corners. */
  static GreyImage sign(int width, int height) {
    return of(width, height, (x, y) -> x > width / 4 && x < 3 * width / 4 && y > height / 4 && y < 3 * height / 4 ? 10 : 245);
  }

  /** Rich in the upper left quarter, white elsewhere. */
  static GreyImage corner(int width, int height) {
    GreyImage rich = leaves(width, height, 5);
    return of(width, height, (x, y) -> x < width / 2 && y < height / 2 ? rich.at(x, y) : 245);
  }

  /** Triangles and discs of many shades, all over: what a good landmark looks like. */
  static GreyImage leaves(int width, int height, int seed) {
    Random random = new Random(seed);
    byte[] pixels = new byte[width * height];
    for (int leaf = 0; leaf < 400; leaf++) {
      int cx = random.nextInt(width);
      int cy = random.nextInt(height);
      int size = 8 + random.nextInt(24);
      int shade = random.nextInt(256);
      boolean square = random.nextBoolean();
      for (int y = Math.max(0, cy - size); y < Math.min(height, cy + size); y++) {
        for (int x = Math.max(0, cx - size); x < Math.min(width, cx + size); x++) {
          if (square ? x - cx < y - cy : (x - cx) * (x - cx) + (y - cy) * (y - cy) < size * size) {
            pixels[y * width + x] = (byte) shade;
          }
        }
      }
    }
    return new GreyImage(width, height, pixels);
  }
}
