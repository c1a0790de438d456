package org.vislam2tag.core.site;

import java.util.Collections;
import java.util.HashMap;
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
  /** Where landmarks hang, by id: x and y in the floor's own frame, m. */
  public final Map<String, double[]> landmarks;
  /** Is there a picture that fills exactly this extent? */
  public final boolean hasPlan;

  private SiteFloor(int number, String name, double[] extentM, Map<String, double[]> landmarks, boolean hasPlan) {
    this.number = number;
    this.name = name;
    leftM = extentM[0];
    rightM = extentM[1];
    lowM = extentM[2];
    highM = extentM[3];
    this.landmarks = landmarks;
    this.hasPlan = hasPlan;
  }

  /** A floor of which nothing but the number is known. */
  public static SiteFloor unknown(int number) {
    return new SiteFloor(number, "", new double[] {0, UNKNOWN_M, 0, UNKNOWN_M}, Collections.emptyMap(), false);
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
      return new SiteFloor(number, name, new double[] {0, UNKNOWN_M, 0, UNKNOWN_M}, landmarks(json.get("landmarks")), false);
    }
    return new SiteFloor(number, name, extentM, landmarks(json.get("landmarks")), Boolean.TRUE.equals(json.get("plan")));
  }

  /** Computers before this told none. */
  private static Map<String, double[]> landmarks(Object told) {
    Map<String, double[]> places = new HashMap<>();
    if (told instanceof Map) {
      ((Map<?, ?>) told).forEach((id, place) -> {
        double[] xy = numbers(place, 2);
        if (xy != null) {
          places.put(String.valueOf(id), xy);
        }
      });
    }
    return places;
  }

  private static double[] extent(Object told) {
    double[] extentM = numbers(told, 4);
    return extentM != null && extentM[1] > extentM[0] && extentM[3] > extentM[2] ? extentM : null;
  }

  /** A list of so many finite numbers; null where it is none. */
  private static double[] numbers(Object told, int count) {
    if (!(told instanceof List) || ((List<?>) told).size() != count) {
      return null;
    }
    double[] numbers = new double[count];
    for (int i = 0; i < count; i++) {
      Object number = ((List<?>) told).get(i);
      if (!(number instanceof Number)) {
        return null;
      }
      numbers[i] = ((Number) number).doubleValue();
    }
    return numbers;
  }

  /** Number and name, as the collector chooses it. */
  @Override public String toString() {
    return name.isEmpty() ? Integer.toString(number) : number + ", " + name;
  }
}
