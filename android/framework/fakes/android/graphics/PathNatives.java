package android.graphics;

import java.awt.geom.Path2D;
import java.awt.geom.PathIterator;
import java.util.ArrayList;
import java.util.List;

/** Paths of lines and curves, as AWT has them. */
final class PathNatives {
  private static final int PER_POINT = 3;

  private PathNatives() {}

  static Path2D.Float of(long path) {
    return Handles.get(path);
  }

  static long nInit() {
    return Handles.of(new Path2D.Float());
  }

  static long nInit(long path) {
    return Handles.of(of(path).clone());
  }

  static void nSet(long to, long from) {
    nReset(to);
    of(to).append(of(from), false);
  }

  static void nReset(long path) {
    of(path).reset();
  }

  static void nRewind(long path) {
    of(path).reset();
  }

  static boolean nIsEmpty(long path) {
    return of(path).getCurrentPoint() == null;
  }

  static void nMoveTo(long path, float x, float y) {
    of(path).moveTo(x, y);
  }

  static void nLineTo(long path, float x, float y) {
    of(path).lineTo(x, y);
  }

  static void nCubicTo(long path, float x1, float y1, float x2, float y2, float x3, float y3) {
    of(path).curveTo(x1, y1, x2, y2, x3, y3);
  }

  static void nClose(long path) {
    of(path).closePath();
  }

  /** Points along the path, of each: its part of the whole length, x, y. */
  static float[] nApproximate(long path, float error) {
    List<double[]> points = new ArrayList<>();
    double[] at = new double[2];
    double length = 0;
    for (PathIterator along = of(path).getPathIterator(null, error); !along.isDone(); along.next()) {
      if (along.currentSegment(at) != PathIterator.SEG_CLOSE) {
        double[] last = points.isEmpty() ? new double[] {0, at[0], at[1]} : points.get(points.size() - 1);
        length += Math.hypot(at[0] - last[1], at[1] - last[2]);
        points.add(new double[] {length, at[0], at[1]});
      }
    }
    float[] flat = new float[PER_POINT * points.size()];
    for (int i = 0; i < points.size(); i++) {
      flat[PER_POINT * i] = (float) (length == 0 ? 0 : points.get(i)[0] / length);
      flat[PER_POINT * i + 1] = (float) points.get(i)[1];
      flat[PER_POINT * i + 2] = (float) points.get(i)[2];
    }
    return flat;
  }
}
