package org.vislam2tag.core.site;

import java.io.IOException;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;
import java.util.Map;
import org.vislam2tag.core.json.JsonReader;

/** The building that is surveyed, as the computer told it. */
public final class Site {
  private static final int NEAR = 3;

  public final String name;
  /** Lowest first. */
  public final List<SiteFloor> floors;

  private Site(String name, List<SiteFloor> floors) {
    this.name = name;
    this.floors = Collections.unmodifiableList(floors);
  }

  /**
   * Of what the computer answers (docs/reference/phone-handover.md).
   *
   * @throws IOException if it is not understood
   */
  public static Site of(String answer) throws IOException {
    Map<String, Object> json = JsonReader.readObject(answer);
    if (!(json.get("name") instanceof String) || !(json.get("floors") instanceof List)) {
      throw new IOException("no name and floors in it");
    }
    List<SiteFloor> floors = new ArrayList<>();
    for (Object told : (List<?>) json.get("floors")) {
      SiteFloor floor = told instanceof Map ? SiteFloor.of((Map<?, ?>) told) : null;
      if (floor != null) {
        floors.add(floor);
      }
    }
    return new Site((String) json.get("name"), floors);
  }

  /** The floors that a collector may have come to from this one: the survey's; without a survey ({@code site} null) those near. */
  public static List<SiteFloor> floorsBeside(Site site, int number) {
    List<SiteFloor> others = new ArrayList<>();
    if (site == null) {
      for (int near = number - NEAR; near <= number + NEAR; near++) {
        others.add(SiteFloor.unknown(near));
      }
    } else {
      others.addAll(site.floors);
    }
    others.removeIf(floor -> floor.number == number);
    return others;
  }

  /** The floor of this number; one of which nothing is known where there is none. */
  public SiteFloor floor(int number) {
    return floors.stream().filter(floor -> floor.number == number).findFirst().orElse(SiteFloor.unknown(number));
  }
}
