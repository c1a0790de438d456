package android.util;

import android.graphics.Handles;
import java.awt.geom.Path2D;
import java.awt.geom.Point2D;
import java.util.Arrays;
import java.util.regex.Matcher;
import java.util.regex.Pattern;

/** Paths written as text, of lines and cubic curves; those of drawings are there and not drawn. */
final class PathParserNatives {
  private static final Pattern PART = Pattern.compile("([MmLlCcZz])([^A-DF-Za-df-z]*)");
  private static final Pattern NUMBER = Pattern.compile("[-+]?[0-9]*\\.?[0-9]+(e[-+]?[0-9]+)?");
  private static final int CURVE = 6;

  private PathParserNatives() {}

  static long nCreatePathDataFromString(String path, int length) {
    return 1;
  }

  static long nCreatePathData(long path) {
    return path;
  }

  static boolean nCanMorph(long from, long to) {
    return true;
  }

  static boolean nInterpolatePathData(long into, long from, long to, float part) {
    return true;
  }

  static void nParseStringForPath(long handle, String text, int length) {
    Path2D.Float path = Handles.get(handle);
    Matcher part = PART.matcher(text);
    while (part.find()) {
      char command = part.group(1).charAt(0);
      float[] at = numbers(part.group(2));
      int step = Character.toUpperCase(command) == 'C' ? CURVE : 2;
      for (int i = 0; i + step <= at.length; i += step) {
        Point2D from = path.getCurrentPoint();
        double x = from == null || Character.isUpperCase(command) ? 0 : from.getX();
        double y = from == null || Character.isUpperCase(command) ? 0 : from.getY();
        if (step == CURVE) {
          path.curveTo(x + at[i], y + at[i + 1], x + at[i + 2], y + at[i + 3], x + at[i + 4], y + at[i + 5]);
        } else if (i == 0 && Character.toUpperCase(command) == 'M') {
          path.moveTo(x + at[0], y + at[1]);
        } else {
          path.lineTo(x + at[i], y + at[i + 1]);
        }
      }
      if (Character.toUpperCase(command) == 'Z') {
        path.closePath();
      }
    }
  }

  private static float[] numbers(String text) {
    Matcher number = NUMBER.matcher(text);
    float[] found = new float[text.length()];
    int count = 0;
    while (number.find()) {
      found[count++] = Float.parseFloat(number.group());
    }
    return Arrays.copyOf(found, count);
  }
}
