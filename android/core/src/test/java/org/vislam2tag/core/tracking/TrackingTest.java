package org.vislam2tag.core.tracking;

import static org.junit.Assert.assertEquals;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.Locale;
import org.junit.Test;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.record.Event;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;
import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;

public class TrackingTest {
  /** Anchors that stay where they were set, until a test moves them all. */
  private static final class Host implements AnchorHost {
    final List<Integer> alive = new ArrayList<>();
    final List<Pose> poses = new ArrayList<>();
    boolean able = true;

    @Override public boolean set(int number, Pose pose) {
      if (able) {
        assertEquals(poses.size(), number);
        alive.add(number);
        poses.add(pose);
      }
      return able;
    }

    @Override public State get(int number) {
      return new State(TrackingState.TRACKING, poses.get(number));
    }

    @Override public void detach(int number) {
      alive.remove(Integer.valueOf(number));
    }
  }

  private static Pose at(float x) {
    return new Pose(x, 0, 0, 0, 0, 0, 1);
  }

  private static TrackedFrame frame(TrackingState state, float x, TrackedImage... images) {
    return new TrackedFrame(new ClockReading(0, 0, 0), 1, state, "NONE", at(x), Arrays.asList(images));
  }

  private static TrackedImage image(String id, TrackingState state) {
    return new TrackedImage(id, state, "LAST_KNOWN_POSE", at(0), 0, 0);
  }

  private static String line(Record record) {
    Row row = new Row();
    record.write(row);
    return row.line().trim();
  }

  @Test public void anAnchorIsSetEveryFiveMetres() {
    Host host = new Host();
    AnchorTrail trail = new AnchorTrail();
    assertEquals(0, trail.at(frame(TrackingState.PAUSED, 0), 1, host).size());
    assertEquals(1, trail.at(frame(TrackingState.TRACKING, 0), 2, host).size());
    assertEquals(1, trail.at(frame(TrackingState.TRACKING, 4.99f), 3, host).size());
    assertEquals(1, trail.at(frame(TrackingState.PAUSED, 6), 4, host).size());
    assertEquals("5,1,TRACKING,5.0,0.0,0.0,0.0,0.0,0.0,1.0", line(trail.at(frame(TrackingState.TRACKING, 5), 5, host).get(1)));
  }

  @Test public void theDistanceIsToWhereTheNewestAnchorIsNow() {
    Host host = new Host();
    AnchorTrail trail = new AnchorTrail();
    trail.at(frame(TrackingState.TRACKING, 0), 1, host);
    host.poses.set(0, at(3));
    assertEquals(1, trail.at(frame(TrackingState.TRACKING, 6), 2, host).size());
    assertEquals(2, trail.at(frame(TrackingState.TRACKING, 8), 3, host).size());
  }

  @Test public void theEightNewestAreFollowed() {
    Host host = new Host();
    AnchorTrail trail = new AnchorTrail();
    for (int i = 0; i < 10; i++) {
      trail.at(frame(TrackingState.TRACKING, 5 * i), i, host);
    }
    assertEquals(Arrays.asList(2, 3, 4, 5, 6, 7, 8, 9), host.alive);
  }

  @Test public void aTrackerThatCannotSetIsAskedAgain() {
    Host host = new Host();
    host.able = false;
    AnchorTrail trail = new AnchorTrail();
    assertEquals(0, trail.at(frame(TrackingState.TRACKING, 0), 1, host).size());
    host.able = true;
    assertEquals(1, trail.at(frame(TrackingState.TRACKING, 0), 2, host).size());
  }

  @Test public void aNewPartHasAnchorsOfItsOwnWithNewNumbers() {
    Host host = new Host();
    AnchorTrail trail = new AnchorTrail();
    trail.at(frame(TrackingState.TRACKING, 0), 1, host);
    trail.newPart();
    assertEquals("2,1,TRACKING,0.0,0.0,0.0,0.0,0.0,0.0,1.0", line(trail.at(frame(TrackingState.TRACKING, 0), 2, host).get(0)));
    assertEquals(Collections.singletonList(1), host.alive);
  }

  @Test public void anImageHasRowsFromItsFirstTrackingToItsStop() {
    ImageRegister register = new ImageRegister();
    assertEquals(0, register.logged(Arrays.asList(image("a", TrackingState.PAUSED))).size());
    assertEquals(1, register.logged(Arrays.asList(image("a", TrackingState.TRACKING))).size());
    assertEquals(1, register.logged(Arrays.asList(image("a", TrackingState.PAUSED))).size());
    assertEquals(1, register.logged(Arrays.asList(image("a", TrackingState.STOPPED))).size());
    assertEquals(0, register.logged(Arrays.asList(image("a", TrackingState.STOPPED))).size());
    assertEquals(1, register.logged(Arrays.asList(image("a", TrackingState.TRACKING))).size());
    register.newPart();
    assertEquals(0, register.logged(Arrays.asList(image("a", TrackingState.PAUSED))).size());
  }

  @Test public void anIdHasOneRowInAFrame() {
    List<TrackedImage> twice = Arrays.asList(image("a", TrackingState.TRACKING), image("a", TrackingState.TRACKING));
    assertEquals(1, new ImageRegister().logged(twice).size());
  }

  @Test public void lossesAreToldWithTheReasonAndHowLongTheyLasted() {
    Locale usual = Locale.getDefault();
    Locale.setDefault(Locale.GERMANY);
    try {
      TrackingWatch watch = new TrackingWatch();
      assertEquals(null, watch.at(frame(TrackingState.PAUSED, 0), 1));
      assertEquals(null, watch.at(frame(TrackingState.TRACKING, 0), 2));
      Event lost = watch.at(frame(TrackingState.PAUSED, 0), 3);
      assertEquals("3,tracking_lost,NONE", line(lost));
      assertEquals(null, watch.at(frame(TrackingState.STOPPED, 0), 4));
      assertEquals("2500000003,tracking_found,2.5", line(watch.at(frame(TrackingState.TRACKING, 0), 2_500_000_003L)));
      assertEquals(null, watch.at(frame(TrackingState.TRACKING, 0), 2_500_000_004L));
    } finally {
      Locale.setDefault(usual);
    }
  }
}
