package org.vislam2tag.core.walk;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNotNull;
import static org.junit.Assert.assertNull;

import java.util.HashMap;
import java.util.Map;
import java.util.Random;
import org.junit.Test;
import org.vislam2tag.core.record.Pose;

public class PlanFitTest {
  private static final double TURN_RAD = 2.3;

  private final Map<String, WalkMap.Point> seen = new HashMap<>();
  private final Map<String, double[]> places = new HashMap<>();

  /** The tracker's frame is turned, of 0.97 true metres, and begins at (31, 7) of the plan. */
  private static double[] onPlan(double xM, double yM) {
    return new double[] {31 + 0.97 * (Math.cos(TURN_RAD) * xM - Math.sin(TURN_RAD) * yM),
        7 + 0.97 * (Math.sin(TURN_RAD) * xM + Math.cos(TURN_RAD) * yM)};
  }

  private void landmark(String id, float xM, float yM, double offM) {
    double[] place = onPlan(xM, yM);
    seen.put(id, new WalkMap.Point(xM, yM));
    places.put(id, new double[] {place[0] + offM, place[1]});
  }

  private void assertPlaces(double withinM) {
    PlanFit fit = PlanFit.of(seen, places);
    assertNotNull(fit);
    for (float[] at : new float[][] {{0, 0}, {10, -4}, {-3.5f, 22}}) {
      double[] expected = onPlan(at[0], at[1]);
      WalkMap.Point found = fit.place(new WalkMap.Point(at[0], at[1]));
      assertEquals(expected[0], found.xM, withinM);
      assertEquals(expected[1], found.yM, withinM);
    }
  }

  @Test public void twoLandmarksTellHowTheWalkLiesOnThePlan() {
    landmark("7", 1, 2, 0);
    assertNull("one does not", PlanFit.of(seen, places));
    landmark("12", 9, -3, 0);
    seen.put("unknown", new WalkMap.Point(50, 50));
    places.put("not seen", new double[] {1, 1});
    assertPlaces(1e-4);
  }

  @Test public void manyAverageTheirErrors() {
    Random random = new Random(5);
    for (int i = 0; i < 200; i++) {
      landmark("l" + i, 30 * random.nextFloat(), 30 * random.nextFloat(), 0.2 * random.nextGaussian());
    }
    assertPlaces(0.1);
  }

  @Test public void landmarksTooNearToEachOtherOrThatContradictTellNothing() {
    landmark("7", 1, 2, 0);
    landmark("8", 1.5f, 2, 0);
    assertNull(PlanFit.of(seen, places));
    seen.remove("8");
    landmark("9", 9, 2, 0);
    assertPlaces(1e-4);
    places.get("9")[0] += 4;
    assertNull(PlanFit.of(seen, places));
  }

  @Test public void theWholeMapIsPutOnThePlan() {
    landmark("7", 1, 2, 0);
    landmark("9", 9, 2, 0);
    WalkMap map = new WalkMap();
    map.scan(); // nobody knows where
    map.at(new Pose(0, 1.4f, 0, 0, 0, 0, 1));
    map.scan();
    map.press();
    map.at(new Pose(10, 1.4f, 4, 0, 0, 0, 1)); // 4 m back: y is -4
    WalkMap.Drawing drawing = map.drawing().on(PlanFit.of(seen, places));
    double[] start = onPlan(0, 0);
    double[] end = onPlan(10, -4);
    assertEquals(1, drawing.scans.size());
    assertEquals(start[0], drawing.scans.get(0).xM, 1e-4);
    assertEquals(start[1], drawing.presses.get(0).yM, 1e-4);
    assertEquals(end[0], drawing.lines.get(0).get(1).xM, 1e-4);
    assertEquals(end[1], drawing.here.yM, 1e-4);
  }
}
