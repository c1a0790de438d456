package org.vislam2tag.core.site;

import java.util.List;
import java.util.Map;

/** A floor of the survey: its number, and the extent of its plan in the floor's own frame, m. */
public final class SiteFloor {
  /** Shown where nobody told an extent: as far as a walk without plan goes, m. */
  private static final double UNKNOWN_M = 50;

  public final int number;
  /** May be empty. */
  public final String name;
  public final double leftM;
  public final double rightM;
  public final double lowM;
  public final double highM;
  /** Is there a picture that fills exactly this extent? */
  public final boolean hasPlan;

  private SiteFloor(int number, String name, double[] extentM, boolean hasPlan) {
    this.number = number;
    this.name = name;
    leftM = extentM[0];
    rightM = extentM[1];
    lowM = extentM[2];
    highM = extentM[3];
    this.hasPlan = hasPlan;
  }

  /** A floor of which nothing but the number is known. */
  public static SiteFloor unknown(int number) {
    return new SiteFloor(number, "", new double[] {0, UNKNOWN_M, 0, UNKNOWN_M}, false);
  }

  /** As the computer tells it; null where it has no number. */
  static SiteFloor of(Map<?, ?> json) {
    if (!(json.get("number") instanceof Long)) {
      return null;
    }
    int number = ((Long) json.get("number")).intValue();
    String name = json.get("name") instanceof String ? (String) json.get("name") : "";
    double[] extentM = extent(json.get("extent_m"));
    if (extentM == null) {
      SiteFloor unknown = unknown(number);
      return new SiteFloor(number, name, new double[] {unknown.leftM, unknown.rightM, unknown.lowM, unknown.highM}, false);
    }
    return new SiteFloor(number, name, extentM, Boolean.TRUE.equals(json.get("plan")));
  }

  private static double[] extent(Object told) {
    if (!(told instanceof List) || ((List<?>) told).size() != 4) {
      return null;
    }
    double[] extentM = new double[4];
    for (int i = 0; i < 4; i++) {
      Object edge = ((List<?>) told).get(i);
      extentM[i] = edge instanceof Number ? ((Number) edge).doubleValue() : Double.NaN;
    }
    return extentM[1] > extentM[0] && extentM[3] > extentM[2] ? extentM : null;
  }

  /** Number and name, as the collector chooses it. */
  @Override public String toString() {
    return name.isEmpty() ? Integer.toString(number) : number + ", " + name;
  }
}
