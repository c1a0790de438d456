package org.vislam2tag.app.recording;

import java.io.File;
import java.util.HashSet;
import java.util.List;
import java.util.Set;
import org.vislam2tag.app.ar.CameraView;
import org.vislam2tag.app.ar.LandmarkImages;
import org.vislam2tag.app.sensing.Feed;
import org.vislam2tag.core.landmarks.Refusal;
import org.vislam2tag.core.session.Recorder;
import org.vislam2tag.core.session.SessionEnd;
import org.vislam2tag.core.session.Ticker;

/** A session being recorded on this phone: the recorder, all that feeds it, and the camera's coming and going. */
public final class Recording implements CameraView.Host {
  private final Recorder recorder;
  private final LandmarkImages landmarks;
  private final List<Feed> feeds;
  private final Ticker ticker;
  private final File developer;
  private int datasets;
  private final Set<String> refusedTold = new HashSet<>();
  private boolean cameraOn;
  private boolean hadCamera;

  /** Starts all feeds of a recorder that has just begun; {@code developer}: where ARCore's recordings go, null: nowhere. */
  public Recording(Recorder recorder, LandmarkImages landmarks, List<Feed> feeds, File developer) {
    this.developer = developer;
    this.recorder = recorder;
    this.landmarks = landmarks;
    this.feeds = feeds;
    if (landmarks.count() == 0) {
      recorder.event("no_landmarks", "");
    }
    tellRefusals();
    for (Feed feed : feeds) {
      feed.start(recorder);
    }
    ticker = new Ticker(recorder);
  }

  /** The recorder: for the screen's status, presses and events. */
  @Override public Recorder recorder() {
    return recorder;
  }

  @Override public LandmarkImages landmarks() {
    return landmarks;
  }

  /** A new file for each tracking session: {@code SESSION-0.mp4}. */
  @Override public synchronized File dataset() {
    return developer == null ? null : new File(developer, recorder.folder().getName() + "-" + datasets++ + ".mp4");
  }

  /** A new tracking session has the camera: from the second on, a new part. */
  @Override public synchronized void cameraAvailable() {
    if (hadCamera) {
      recorder.newPart();
      recorder.camera(true, "");
    }
    hadCamera = true;
    cameraOn = true;
    tellRefusals();
  }

  /** Tells it once, however often it is tried again. */
  @Override public synchronized void cameraUnavailable(String reason) {
    if (cameraOn || !hadCamera) {
      recorder.camera(false, reason);
      hadCamera = true;
    }
    cameraOn = false;
  }

  /** Ends all that feeds the session; on the thread that started it. */
  void stopFeeds() {
    for (Feed feed : feeds) {
      feed.stop();
    }
  }

  /** Ends the session. Waits for the disk. */
  SessionEnd stop() {
    SessionEnd end = recorder.stop();
    ticker.close();
    return end;
  }

  /** The loader's at once; the tracker's own once it has made its database. */
  private void tellRefusals() {
    for (Refusal refusal : landmarks.refusals()) {
      if (refusedTold.add(refusal.id)) {
        recorder.event("landmark_refused", refusal.words());
      }
    }
  }
}
