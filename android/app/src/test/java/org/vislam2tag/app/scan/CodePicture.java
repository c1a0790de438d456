package org.vislam2tag.app.scan;

import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.List;
import java.util.Random;

/** The code as {@code vislam2tag receive} draws it in a terminal, seen by a camera. */
final class CodePicture {
  static final String TEXT = "http://192.168.1.20:8765/#ABCDEFGHIJKL2345";
  static final int WIDTH = 640;
  static final int HEIGHT = 480;
  /** A row of the camera's pictures may be longer than what is seen. */
  static final int STRIDE = 672;

  private final List<String> lines;
  private final double moduleWidth;
  private final double cos;
  private final double sin;
  private final boolean inverted;

  /** Turned by {@code degrees}, a module so many pixels wide; inverted as on a light terminal. */
  CodePicture(double degrees, double moduleWidth, boolean inverted) throws IOException {
    File here = new File("src/test/resources"); // Gradle runs tests in the module's folder, build.sh in the one above
    File folder = here.isDirectory() ? here : new File("app/src/test/resources");
    lines = Files.readAllLines(new File(folder, "receive-code.txt").toPath(), StandardCharsets.UTF_8);
    this.moduleWidth = moduleWidth;
    this.inverted = inverted;
    cos = Math.cos(Math.toRadians(degrees));
    sin = Math.sin(Math.toRadians(degrees));
  }

  /** Rows of {@link #STRIDE} bytes, out of focus by a blur so many pixels wide, with noise of a dim room. */
  byte[] grey(int blur) {
    Random noise = new Random(7);
    byte[] grey = new byte[STRIDE * HEIGHT];
    for (int y = 0; y < HEIGHT; y++) {
      for (int x = 0; x < WIDTH; x++) {
        double light = 0;
        for (int i = 0; i < blur * blur; i++) {
          light += light(x + i % blur - blur / 2, y + i / blur - blur / 2) / (blur * blur);
        }
        grey[y * STRIDE + x] = (byte) (60 + 110 * light + 6 * noise.nextGaussian());
      }
    }
    return grey;
  }

  private double light(double x, double y) {
    double column = ((x - WIDTH / 2.0) * cos + (y - HEIGHT / 2.0) * sin) / moduleWidth + lines.get(0).length() / 2.0;
    double row = ((y - HEIGHT / 2.0) * cos - (x - WIDTH / 2.0) * sin) / moduleWidth + lines.size();
    if (column < 0 || row < 0 || column >= lines.get(0).length() || row >= 2 * lines.size()) {
      return inverted ? 1 : 0;
    }
    char block = lines.get((int) row / 2).charAt((int) column);
    boolean shown = block == '\u2588' || block == ((int) row % 2 == 0 ? '\u2580' : '\u2584');
    return shown == inverted ? 0 : 1;
  }
}
