package org.vislam2tag.app.record;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertNotEquals;
import static org.junit.Assert.assertTrue;

import java.util.Arrays;
import java.util.Collections;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.R;
import org.vislam2tag.app.Recorded;
import org.vislam2tag.app.recording.PhoneClocks;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;
import org.vislam2tag.core.session.Recorder;
import org.vislam2tag.core.session.RecorderStatus;

public class StatusTextTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final StatusText text = new StatusText((id, parts) -> id + Arrays.toString(parts));

  @Test public void withoutCameraThatIsSaid() throws Exception {
    RecorderStatus status = new Recorded(folder.getRoot()).recorder.status();
    assertEquals(R.string.tracking_no_camera + "[]", text.tracking(status.walk));
    assertTrue(text.landmarks(status.walk).startsWith(R.string.status_no_landmark_yet + "["));
    assertEquals("", text.warnings(status.walk));
  }

  @Test public void whyTrackingIsLostIsSaid() throws Exception {
    assertEquals(R.string.tracking_good + "[]", text.tracking(after(TrackingState.TRACKING, "NONE").walk));
    assertEquals(R.string.tracking_dark + "[]", text.tracking(after(TrackingState.PAUSED, "INSUFFICIENT_LIGHT").walk));
    assertEquals(R.string.tracking_lost + "[]", text.tracking(after(TrackingState.PAUSED, "A_NEW_REASON").walk));
  }

  @Test public void theLastLandmarkIsNamed() throws Exception {
    RecorderStatus status = after(TrackingState.TRACKING, "NONE");
    assertTrue(text.landmarks(status.walk).startsWith(R.string.status_landmarks + "[1, 12"));
  }

  @Test public void howToCalibrateTheMagnetometerIsSaidWhileItWantsIt() throws Exception {
    Recorder recorder = new Recorded(folder.newFolder()).recorder;
    assertEquals("", text.hints(recorder.status()));
    recorder.accuracy(SensorKind.MAG, 0);
    assertEquals(R.string.calibrate_magnetometer + "[]", text.hints(recorder.status()));
  }

  @Test public void beforeTheEndItSumsUp() throws Exception {
    String[] lines = text.summary(after(TrackingState.TRACKING, "NONE")).split("\n");
    assertEquals(R.string.summary_walk + "[0.0, 1, 0.0]", lines[0]);
    assertEquals(R.string.summary_not_placed + "[]", lines[1]);
    assertEquals(R.string.summary_lost + "[0.0]", lines[2]);
    assertTrue(lines[3].startsWith(R.string.status_scans + "["));
  }

  @Test public void whereToWalkAgainIsSaidWhereALandmarkLacksForLong() throws Exception {
    assertEquals(R.string.summary_expected + "[", text.summary(walked(20)).split("\n")[1].replaceAll("\\[.*", "["));
    assertFalse(text.summary(walked(20)).contains(Integer.toString(R.string.summary_walk_again)));
    String again = text.summary(walked(200)).split("\n")[2];
    assertTrue(again, again.startsWith(R.string.summary_walk_again + "[12, 7, 200."));
  }

  /** A walk of so many metres, at a metre a second, from landmark 12 to landmark 7. */
  private RecorderStatus walked(int metres) throws Exception {
    Recorder recorder = new Recorded(folder.newFolder()).recorder;
    for (int i = 0; i <= 10 * metres; i++) {
      long nowNs = 1_000_000_000L + 100_000_000L * i;
      Pose pose = new Pose(i / 10f, 0, 0, 0, 0, 0, 1);
      String id = i == 0 ? "12" : "7";
      boolean near = i == 0 || i == 10 * metres;
      TrackedImage image = new TrackedImage(id, TrackingState.TRACKING, TrackedImage.SEEN_NOW, pose, 0.2f, 0.2f);
      recorder.frame(new TrackedFrame(new ClockReading(nowNs, nowNs, 0), nowNs - 1, TrackingState.TRACKING, "NONE", pose,
          near ? Collections.singletonList(image) : Collections.emptyList()), new NoAnchors());
    }
    return recorder.status();
  }

  @Test public void whatWasNotHeardWithTheScreenOffIsSummedUpWithTheRemedy() throws Exception {
    Recorder recorder = new Recorded(folder.newFolder()).recorder;
    assertFalse(text.summary(recorder.status()).contains(R.string.stopped_remedy + "["));
    RecorderStatus status = recorder.status();
    status.silentS.put(Radio.BLE, 312.0);
    assertTrue(text.summary(status).endsWith("\n" + R.string.summary_ble_silent + "[312.0] " + R.string.stopped_remedy + "[]"));
  }

  @Test public void refusedScansAreToldWithTheRemedy() throws Exception {
    Recorded recorded = new Recorded(folder.newFolder());
    String before = text.scans(recorded.recorder.status());
    recorded.recorder.scanRefused();
    String after = text.scans(recorded.recorder.status());
    assertNotEquals(before, after);
    assertTrue(after.contains(R.string.status_throttled + "["));
  }

  @Test public void refusalsWithoutThrottlingAreNotTakenForIt() throws Exception {
    Recorded recorded = new Recorded(folder.newFolder());
    recorded.recorder.throttling(false);
    recorded.recorder.scanRefused(); // Wi-Fi is just off, for instance
    assertFalse(text.scans(recorded.recorder.status()).contains(R.string.status_throttled + "["));
  }

  @Test public void aClockThatRunsAsItShouldIsNotSpokenOf() throws Exception {
    assertEquals("", text.hints(new Recorded(folder.newFolder()).recorder.status()));
  }

  private RecorderStatus after(TrackingState state, String failure) throws Exception {
    Recorded recorded = new Recorded(folder.newFolder());
    Pose pose = new Pose(0, 0, 0, 0, 0, 0, 1);
    TrackedImage image = new TrackedImage("12", TrackingState.TRACKING, TrackedImage.SEEN_NOW, pose, 0.2f, 0.2f);
    PhoneClocks clocks = new PhoneClocks();
    recorded.recorder.frame(new TrackedFrame(clocks.read(), 1, state, failure, pose, Collections.singletonList(image)),
        new NoAnchors());
    return recorded.recorder.status();
  }
}
