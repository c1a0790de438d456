package org.vislam2tag.app.ar;

import static org.junit.Assert.assertEquals;

import org.junit.Test;

public class LandmarkImagesTest {
  @Test public void ofLargeImagesFewerPixelsAreTaken() {
    assertEquals(1, LandmarkImages.sample(1000, 1000));
    assertEquals(2, LandmarkImages.sample(4000, 3000));
    assertEquals(4, LandmarkImages.sample(8000, 6000));
  }

  @Test public void theShorterSideKeepsWhatTheTrackerNeeds() {
    assertEquals(1, LandmarkImages.sample(100_000, 700));
    assertEquals(1, LandmarkImages.sample(-1, -1)); // no image
  }

  @Test public void withoutAFolderThereAreNone() {
    assertEquals(0, LandmarkImages.none().count());
    assertEquals(0, LandmarkImages.none().refusedIds().length);
  }
}
