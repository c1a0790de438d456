package org.vislam2tag.app.setup;

import static org.junit.Assert.assertEquals;

import org.junit.Test;
import org.vislam2tag.core.site.Site;

public class PlaceChoiceTest {
  @Test public void theFloorOfTheLastTimeIsChosenWhereTheBuildingHasIt() throws Exception {
    Site site = Site.of("{\"name\": \"A\", \"floors\": [{\"number\": -1}, {\"number\": 3, \"name\": \"third\"}, {\"number\": 4}]}");
    assertEquals(1, PlaceChoice.place(site, "3"));
    assertEquals(0, PlaceChoice.place(site, "7"));
    assertEquals(0, PlaceChoice.place(site, "third"));
  }
}
