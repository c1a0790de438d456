package org.vislam2tag.app.recording;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertSame;
import static org.junit.Assert.assertTrue;

import java.io.File;
import java.nio.file.Files;
import java.util.Arrays;
import java.util.Collections;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.Recorded;
import org.vislam2tag.app.ar.LandmarkImages;
import org.vislam2tag.app.sensing.Feed;
import org.vislam2tag.core.landmarks.DiskFolder;
import org.vislam2tag.core.session.EndState;
import org.vislam2tag.core.session.Recorder;

public class RecordingTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();

  /** Counts how often it was begun and ended. */
  private static final class Counting implements Feed {
    int begun;
    int ended;

    @Override public void start(Recorder recorder) {
      begun++;
    }

    @Override public void stop() {
      ended++;
    }
  }

  @Test public void eachTrackingSessionIsRecordedIntoAFileOfItsOwnWhereDevelopersAskForIt() throws Exception {
    Recorded recorded = new Recorded(folder.newFolder());
    String name = recorded.recorder.folder().getName();
    Recording recording = new Recording(recorded.recorder, none(), Collections.emptyList(), folder.getRoot());
    assertEquals(new File(folder.getRoot(), name + "-0.mp4"), recording.dataset());
    assertEquals(new File(folder.getRoot(), name + "-1.mp4"), recording.dataset());
    assertEquals(null, new Recording(recorded.recorder, none(), Collections.emptyList(), null).dataset());
    recording.stop();
  }

  @Test public void theCameraComingAgainIsANewPartAndItsTriesAreToldOnce() throws Exception {
    Recorded recorded = new Recorded(folder.newFolder());
    Recording recording = new Recording(recorded.recorder, none(), Collections.emptyList(), null);
    recording.cameraAvailable();
    recording.cameraUnavailable("screen");
    recording.cameraUnavailable("CameraNotAvailableException");
    recording.cameraAvailable();
    recording.stop();
    assertEquals(Arrays.asList("no_landmarks,", "camera_unavailable,screen", "camera_available,"), recorded.events());
  }

  @Test public void aCameraThatNeverComesIsToldOnce() throws Exception {
    Recorded recorded = new Recorded(folder.newFolder());
    Recording recording = new Recording(recorded.recorder, none(), Collections.emptyList(), null);
    recording.cameraUnavailable("UnavailableApkTooOldException");
    recording.cameraUnavailable("UnavailableApkTooOldException");
    recording.stop();
    assertEquals(Arrays.asList("no_landmarks,", "camera_unavailable,UnavailableApkTooOldException"), recorded.events());
  }

  @Test public void allFeedsBeginAndEnd() throws Exception {
    Counting feed = new Counting();
    Recording recording = new Recording(new Recorded(folder.newFolder()).recorder, none(), Collections.singletonList(feed), null);
    assertEquals(1, feed.begun);
    recording.stopFeeds();
    assertEquals(1, feed.ended);
    assertEquals(EndState.STOPPED, recording.stop().state);
    assertTrue(recording.recorder().isEnded());
  }

  @Test public void whatTheTrackerRefusesIsTold() throws Exception {
    File images = folder.newFolder();
    Files.write(new File(images, "manifest.csv").toPath(), "id,file,width_m\n7,gone.png,0.2\n".getBytes("UTF-8"));
    Recorded recorded = new Recorded(folder.newFolder());
    new Recording(recorded.recorder, LandmarkImages.load(new DiskFolder(images), 0.2f, images), Collections.emptyList(), null).stop();
    assertTrue(recorded.events().toString(), recorded.events().contains("landmark_refused,7 no_file: gone.png"));
  }

  @Test public void aSecondStartGoesOnWithTheRecordingThatRuns() throws Exception {
    RecordingService service = new RecordingService();
    service.recording = new Recording(new Recorded(folder.newFolder()).recorder, none(), Collections.emptyList(), null);
    RecordingService.Link link = (RecordingService.Link) service.onBind(null);
    Recording first = link.recording();
    link.start(null);
    assertSame(first, link.recording());
    first.stop();
  }

  @Test public void theServiceSaysLocationOnlyWhereItIsAllowed() {
    assertEquals(0x10, RecordingService.foregroundType(false));
    assertEquals(0x18, RecordingService.foregroundType(true));
  }

  private LandmarkImages none() throws Exception {
    return LandmarkImages.load(new DiskFolder(folder.newFolder()), 0.2f, folder.getRoot());
  }
}
