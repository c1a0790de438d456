package org.vislam2tag.core.walk;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;

import org.junit.Test;

public class PlanFrameTest {
  private static final double EXACT = 1e-4;

  private final PlanFrame frame = new PlanFrame(-10, 0, 90, 40, 1000, 800, 2.5);

  @Test public void theWholeFloorIsSeenAtFirstUprightAndInTheMiddle() {
    assertEquals(500, frame.x(40), EXACT);
    assertEquals(400, frame.y(20), EXACT);
    assertTrue(frame.x(-10) > 0 && frame.x(90) < 1000);
    assertTrue(frame.y(40) < frame.y(0));
  }

  @Test public void aPixelIsThePlaceThatIsDrawnThere() {
    frame.enlarge(3, 200, 600);
    frame.move(17, -40);
    assertEquals(12.5, frame.xM(frame.x(12.5)), EXACT);
    assertEquals(31, frame.yM(frame.y(31)), EXACT);
  }

  @Test public void whatIsBetweenTwoFingersStaysThere() {
    double xM = frame.xM(200);
    double yM = frame.yM(600);
    frame.enlarge(5, 200, 600);
    assertEquals(200, frame.x(xM), EXACT);
    assertEquals(600, frame.y(yM), EXACT);
  }

  @Test public void itGetsNoSmallerThanWhole() {
    frame.enlarge(0.1, 500, 400);
    assertEquals(500, frame.x(40), EXACT);
    assertEquals(9.2, frame.x(1) - frame.x(0), EXACT); // 92 % of 1000 pixels for 100 m
  }

  @Test public void aTapOnAnEnlargedPlanIsSurerButNeverSurerThanPeopleAre() {
    assertEquals(Math.hypot(0.5, 25 / 9.2), frame.sigmaM(), EXACT); // 10 dp are 25 pixels
    frame.enlarge(1000, 500, 400);
    assertEquals(Math.hypot(0.5, 25 / 368.0), frame.sigmaM(), EXACT);
  }
}
