package org.vislam2tag.core.walk;

import java.util.ArrayList;
import java.util.List;
import java.util.Map;

/** How the tracker's plane lies on a floor's plan: turned, scaled and shifted so that the landmarks seen lie where they hang. */
public final class PlanFit {
  /** Landmarks nearer to each other than this do not tell how the walk is turned, m. */
  static final double APART_M = 2;
  /** A tracker's metres are right within this share: where they seem not to be, a landmark hangs elsewhere. */
  static final double SCALE_SHARE = 0.1;

  private final double cosine;
  private final double sine;
  private final double shiftX;
  private final double shiftY;

  private PlanFit(double cosine, double sine, double shiftX, double shiftY) {
    this.cosine = cosine;
    this.sine = sine;
    this.shiftX = shiftX;
    this.shiftY = shiftY;
  }

  /**
   * By least squares over the landmarks that were seen ({@code seen}) and whose place on the plan is known ({@code places}, x and y
   * in metres); null where they are not two, too near to each other, or contradict each other.
   */
  public static PlanFit of(Map<String, WalkMap.Point> seen, Map<String, double[]> places) {
    List<double[]> pairs = new ArrayList<>();
    seen.forEach((id, point) -> {
      if (places.containsKey(id)) {
        pairs.add(new double[] {point.xM, point.yM, places.get(id)[0], places.get(id)[1]});
      }
    });
    double[] mean = new double[4];
    for (double[] pair : pairs) {
      for (int i = 0; i < mean.length; i++) {
        mean[i] += pair[i] / pairs.size();
      }
    }
    double along = 0;
    double across = 0;
    double spread = 0;
    double farthest = 0;
    for (double[] pair : pairs) {
      double x = pair[0] - mean[0];
      double y = pair[1] - mean[1];
      double toX = pair[2] - mean[2];
      double toY = pair[3] - mean[3];
      along += x * toX + y * toY;
      across += x * toY - y * toX;
      spread += x * x + y * y;
      farthest = Math.max(farthest, Math.hypot(x, y));
    }
    if (pairs.size() < 2 || farthest < APART_M / 2 || Math.abs(Math.hypot(along, across) / spread - 1) > SCALE_SHARE) {
      return null;
    }
    double cosine = along / spread;
    double sine = across / spread;
    return new PlanFit(cosine, sine, mean[2] - cosine * mean[0] + sine * mean[1], mean[3] - sine * mean[0] - cosine * mean[1]);
  }

  /** Where a place of the walk lies on the plan. */
  public WalkMap.Point place(WalkMap.Point point) {
    return new WalkMap.Point((float) (cosine * point.xM - sine * point.yM + shiftX),
        (float) (sine * point.xM + cosine * point.yM + shiftY));
  }
}
