package org.vislam2tag.core.walk;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;

import java.util.Arrays;
import java.util.Collections;
import java.util.EnumSet;
import java.util.List;
import org.junit.Test;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;

public class WalkTest {
  private static final long FRAME_NS = 33_000_000L;

  private final Walk walk = new Walk(new WarningSettings(20, 15, 1, 1.8, 1.6), 0, true);
  private long nowNs;
  private float x;

  private static Pose at(float x, double turnedRad) {
    return new Pose(x, 1.4f, -2 * x, 0, (float) Math.sin(turnedRad / 2), 0, (float) Math.cos(turnedRad / 2));
  }

  private static TrackedImage seen(String id) {
    return new TrackedImage(id, TrackingState.TRACKING, "FULL_TRACKING", at(7, 0), 0, 0);
  }

  private static TrackedImage remembered(String id) {
    return new TrackedImage(id, TrackingState.TRACKING, "LAST_KNOWN_POSE", at(7, 0), 0, 0);
  }

  private void frame(TrackingState state, Pose pose, boolean beginsPart, TrackedImage... images) {
    List<TrackedImage> list = Arrays.asList(images);
    nowNs += FRAME_NS;
    ClockReading arrival = new ClockReading(nowNs, nowNs, 0);
    walk.frame(new TrackedFrame(arrival, nowNs, state, state == TrackingState.TRACKING ? "NONE" : "EXCESSIVE_MOTION", pose, list),
        nowNs, list, beginsPart);
  }

  /** Walks for some seconds; the way is sqrt(5) times x. */
  private void go(double seconds, double speedMps, TrackedImage... images) {
    for (long end = nowNs + (long) (seconds * 1e9); nowNs < end; ) {
      x += (float) (speedMps / Math.sqrt(5) * FRAME_NS / 1e9);
      frame(TrackingState.TRACKING, at(x, 0), false, images);
    }
  }

  @Test public void metresSpeedAndFramesASecondAreThoseOfTheWalk() {
    go(10, 1.2);
    WalkStatus status = walk.status(nowNs);
    assertEquals(12, status.walkedM, 0.05);
    assertEquals(1.2, status.speedMps, 0.01);
    assertEquals(30.3, status.framesPerS, 0.1);
    assertEquals(TrackingState.TRACKING, status.tracking);
    assertEquals(0, status.lostS, 0);
  }

  @Test public void theTrackersJumpsAreNoWay() {
    go(2, 1);
    double before = walk.status(nowNs).walkedM;
    x += 30;
    frame(TrackingState.TRACKING, at(x, 0), false);
    assertEquals(before, walk.status(nowNs).walkedM, 1e-6);
    assertEquals(1, walk.status(nowNs).speedMps, 0.05);
  }

  @Test public void whatLiesBetweenTwoPartsOrInAGapIsNoWay() {
    go(2, 1);
    double before = walk.status(nowNs).walkedM;
    frame(TrackingState.TRACKING, at(x + 0.1f, 0), true);
    nowNs += 5_000_000_000L;
    frame(TrackingState.TRACKING, at(x + 0.2f, 0), false);
    assertEquals(before, walk.status(nowNs).walkedM, 1e-6);
  }

  @Test public void landmarksCountOnlyWhenTheyAreInView() {
    go(1, 1, remembered("7"));
    assertEquals(0, walk.status(nowNs).landmarksSeen);
    assertNull(walk.status(nowNs).lastLandmark);
    go(1, 1, seen("7"), remembered("8"));
    go(1, 1, seen("9"));
    go(2, 1, remembered("9"));
    WalkStatus status = walk.status(nowNs);
    assertEquals(2, status.landmarksSeen);
    assertEquals("9", status.lastLandmark);
    assertEquals(2, status.sinceLandmarkS, 0.1);
    assertEquals(2, status.sinceLandmarkM, 0.1);
  }

  @Test public void itWarnsWhenALandmarkIsOverdueInMetresOrInSeconds() {
    go(14, 1);
    assertEquals(Collections.emptySet(), walk.warnings(nowNs));
    go(2, 1);
    assertEquals(EnumSet.of(Warning.NO_LANDMARK), walk.warnings(nowNs));
    assertEquals(Collections.emptySet(), walk.warnings(nowNs));
    assertEquals(EnumSet.of(Warning.NO_LANDMARK), walk.status(nowNs).warnings);
    go(0.1, 1, seen("7"));
    walk.warnings(nowNs);
    assertEquals(Collections.emptySet(), walk.status(nowNs).warnings);
    go(21, 0.1);
    assertEquals(EnumSet.of(Warning.NO_LANDMARK), walk.warnings(nowNs));
  }

  @Test public void itWarnsWhenTrackingIsLostAndWhenNoFramesCome() {
    go(1, 1, seen("7"));
    frame(TrackingState.PAUSED, at(x, 0), false);
    assertEquals(Collections.emptySet(), walk.warnings(nowNs));
    for (int i = 0; i < 40; i++) {
      frame(TrackingState.PAUSED, at(x, 0), false);
    }
    assertEquals(EnumSet.of(Warning.TRACKING), walk.warnings(nowNs));
    assertEquals("EXCESSIVE_MOTION", walk.status(nowNs).failure);
    go(0.1, 1);
    walk.warnings(nowNs);
    assertEquals(Collections.emptySet(), walk.status(nowNs).warnings);
    nowNs += 1_500_000_000L;
    assertEquals(EnumSet.of(Warning.TRACKING), walk.warnings(nowNs));
    assertNull(walk.status(nowNs).tracking);
    assertEquals(1.5, walk.status(nowNs).lostS, 0.01);
  }

  @Test public void theTrackerMayTakeAFewSecondsToBegin() {
    frame(TrackingState.PAUSED, at(0, 0), false);
    nowNs = 4_000_000_000L;
    assertEquals(Collections.emptySet(), walk.warnings(nowNs));
    nowNs = 6_500_000_000L;
    assertEquals(EnumSet.of(Warning.TRACKING), walk.warnings(nowNs));
  }

  @Test public void whileLandmarksAreMadeReadyItWarnsOfNothing() {
    nowNs = 120_000_000_000L;
    assertEquals(Collections.emptySet(), walk.warnings(nowNs));
    go(1, 1);
    assertEquals(Collections.emptySet(), walk.warnings(nowNs));
    assertEquals("counted from the first frame on", 1, walk.status(nowNs).sinceLandmarkS, 0.05);
  }

  @Test public void aLandmarkIsCaughtWhenItComesIntoView() {
    go(1, 1, seen("7"));
    assertEquals(Collections.singletonList("7"), walk.takeCaught());
    go(4, 1);
    go(1, 1, seen("7"), remembered("8"));
    assertEquals("it was away for four seconds only", Collections.emptyList(), walk.takeCaught());
    go(6, 1);
    go(1, 1, seen("7"), seen("9"));
    assertEquals(Arrays.asList("7", "9"), walk.takeCaught());
  }

  @Test public void theWorstWayWithoutALandmarkAndAllLossesAreKnown() {
    go(8, 1);
    go(1, 1, seen("7"));
    assertEquals(8, walk.status(nowNs).worst.metres, 0.1);
    go(3, 1);
    frame(TrackingState.PAUSED, at(x, 0), false);
    nowNs += 2_000_000_000L;
    go(1, 1, seen("7"));
    assertEquals(8, walk.status(nowNs).worst.metres, 0.1);
    assertEquals(2.1, walk.status(nowNs).lostInAllS, 0.05);
    nowNs += 3_000_000_000L;
    assertEquals("no frame since", 5.1, walk.status(nowNs).lostInAllS, 0.05);
  }

  @Test public void nobodyIsSentToALandmarkWhereThereIsNone() {
    Walk without = new Walk(new WarningSettings(20, 15, 1, 1.8, 1.6), 0, false);
    for (int i = 1; i < 2000; i++) {
      ClockReading arrival = new ClockReading(i * FRAME_NS, i * FRAME_NS, 0);
      without.frame(new TrackedFrame(arrival, i * FRAME_NS, TrackingState.TRACKING, "NONE", at(i * 0.01f, 0),
          Collections.emptyList()), i * FRAME_NS, Collections.emptyList(), false);
    }
    assertEquals(Collections.emptySet(), without.warnings(2000 * FRAME_NS));
  }

  @Test public void itWarnsOfHasteAndOfFastTurns() {
    go(2, 1.7, seen("7"));
    assertEquals(Collections.emptySet(), walk.warnings(nowNs));
    go(2, 2.2, seen("7"));
    assertEquals(EnumSet.of(Warning.TOO_FAST), walk.warnings(nowNs));
    go(2, 1.7, seen("7"));
    walk.warnings(nowNs);
    assertEquals("it goes off below 80 %", EnumSet.of(Warning.TOO_FAST), walk.status(nowNs).warnings);
    go(2, 1, seen("7"));
    walk.warnings(nowNs);
    for (int i = 0; i < 60; i++) {
      frame(TrackingState.TRACKING, at(x, i * 2 * FRAME_NS / 1e9), false, seen("7"));
    }
    assertEquals(EnumSet.of(Warning.TOO_FAST), walk.warnings(nowNs));
  }

  @Test public void hasteIsOverWhenNoFramesCome() {
    go(2, 2.2, seen("7"));
    walk.warnings(nowNs);
    nowNs += 600_000_000L;
    assertEquals(Collections.emptySet(), walk.warnings(nowNs));
    assertEquals(Collections.emptySet(), walk.status(nowNs).warnings);
    assertEquals(0, walk.status(nowNs).speedMps, 0);
  }

  @Test public void undoTakesThePressesBackOneByOne() {
    PressCount presses = new PressCount();
    assertNull(presses.latest());
    assertNull(presses.undo(1));
    presses.press(2);
    presses.press(3);
    assertEquals(2, presses.counting());
    presses.undo(4);
    presses.press(5);
    presses.undo(6);
    presses.undo(7);
    assertNull(presses.undo(8));
    assertEquals(0, presses.counting());
  }

  @Test public void theMapHasALineForEachStretchAndTheLandmarksWhereTheyAreNow() {
    WalkMap map = walk.map();
    go(4, 1, seen("7"));
    map.press();
    frame(TrackingState.PAUSED, at(x, 0), false);
    x += 2;
    go(1, 1, new TrackedImage("7", TrackingState.TRACKING, "FULL_TRACKING", at(8, 0), 0, 0));
    WalkMap.Drawing drawing = map.drawing();
    assertEquals(2, drawing.lines.size());
    assertEquals(8, drawing.landmarks.get("7").xM, 0);
    assertEquals(16, drawing.landmarks.get("7").yM, 0);
    assertEquals(1, drawing.presses.size());
    assertEquals(x, drawing.here.xM, 1e-6);
    assertTrue("a point every 25 cm: " + drawing.lines.get(0).size(), Math.abs(drawing.lines.get(0).size() - 16) <= 2);
    map.undoPress();
    assertEquals(0, map.drawing().presses.size());
    frame(TrackingState.TRACKING, at(0, 0), true);
    assertEquals(1, map.drawing().lines.size());
    assertEquals(0, map.drawing().landmarks.size());
  }

  @Test public void aLongWalkKeepsABoundedMap() {
    WalkMap map = new WalkMap();
    for (int i = 0; i < 100_000; i++) {
      if (i % 1000 == 0) {
        map.broke();
      }
      map.at(at(i * 0.1f, 0));
    }
    int points = map.drawing().lines.stream().mapToInt(List::size).sum();
    assertTrue(points + " points", points > WalkMap.MOST_POINTS / 4 && points <= WalkMap.MOST_POINTS);
  }

  @Test public void aMapOfNothingButSinglePointsStaysBoundedToo() {
    WalkMap map = new WalkMap();
    for (int i = 0; i < 10_000; i++) {
      map.at(at(i, 0));
      map.broke();
    }
    assertTrue(map.drawing().lines.size() <= WalkMap.MOST_POINTS);
  }
}
