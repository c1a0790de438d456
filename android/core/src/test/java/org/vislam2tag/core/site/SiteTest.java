package org.vislam2tag.core.site;

import static org.junit.Assert.assertEquals;

import java.io.IOException;
import org.junit.Test;

public class SiteTest {
  @Test public void aCollectorGoesToAnotherFloorOfTheSurvey() throws IOException {
    Site site = Site.of("{\"name\": \"B\", \"floors\": [{\"number\": -1, \"name\": \"\"}, {\"number\": 0, \"name\": \"EG\"}, "
        + "{\"number\": 2, \"name\": \"\"}]}");
    assertEquals("[-1, 2]", Site.floorsBeside(site, 0).toString());
    assertEquals("[-1, 0, EG, 2]", Site.floorsBeside(site, 7).toString());
  }

  @Test public void landmarksAreKnownByFloor() throws IOException {
    Site site = Site.of("{\"name\": \"B\", \"floors\": [{\"number\": 0, \"name\": \"\", \"extent_m\": [0, 9, 0, 9], \"landmarks\": "
        + "{\"12\": [3.5, -1], \"bad\": [1], \"worse\": \"x\"}}, {\"number\": 1, \"name\": \"\"}]}");
    assertEquals("[12]", site.floor(0).landmarks.keySet().toString());
    assertEquals(-1, site.floor(0).landmarks.get("12")[1], 0);
    assertEquals(0, site.floor(1).landmarks.size());
    assertEquals(0, site.floor(9).landmarks.size());
  }

  @Test public void withoutASurveyTheFloorsNearAreOffered() {
    assertEquals("[1, 2, 3, 5, 6, 7]", Site.floorsBeside(null, 4).toString());
  }
}
