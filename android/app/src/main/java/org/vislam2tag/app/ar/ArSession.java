package org.vislam2tag.app.ar;

import android.content.Context;
import android.net.Uri;
import android.util.Log;
import com.google.ar.core.AugmentedImage;
import com.google.ar.core.AugmentedImageDatabase;
import com.google.ar.core.Config;
import com.google.ar.core.Frame;
import com.google.ar.core.RecordingConfig;
import com.google.ar.core.Session;
import com.google.ar.core.exceptions.CameraNotAvailableException;
import com.google.ar.core.exceptions.RecordingFailedException;
import com.google.ar.core.exceptions.UnavailableException;
import java.io.File;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.session.Recorder;

/** One ARCore session: one part of a recording, with a frame of reference of its own. */
final class ArSession implements Tracker {
  private final Session session;
  private final ArAnchors anchors;
  private final File dataset;
  private long lastNs;

  /** A session that looks for landmarks, recorded into {@code dataset} unless that is null. Takes seconds for hundreds of them: not for the screen's threads. */
  static ArSession open(Context context, LandmarkImages landmarks, File dataset) throws UnavailableException {
    Session session = new Session(context);
    try {
      return new ArSession(session, landmarks, dataset);
    } catch (RuntimeException e) {
      session.close();
      throw e;
    }
  }

  ArSession(Session session, LandmarkImages landmarks, File dataset) {
    this.session = session;
    this.dataset = dataset;
    anchors = new ArAnchors(session);
    Config config = new Config(session);
    AugmentedImageDatabase images = landmarks.database(session);
    config.setAugmentedImageDatabase(images);
    config.setUpdateMode(Config.UpdateMode.LATEST_CAMERA_IMAGE); // never waits: the screen goes on when the camera does not
    config.setFocusMode(Config.FocusMode.AUTO); // sheets are looked at from near
    config.setPlaneFindingMode(Config.PlaneFindingMode.DISABLED);
    config.setLightEstimationMode(Config.LightEstimationMode.DISABLED);
    session.configure(config);
  }

  @Override public void resume(int texture, int rotation, int width, int height) throws CameraNotAvailableException {
    session.setCameraTextureName(texture);
    session.setDisplayGeometry(rotation, width, height);
    session.resume();
    if (dataset != null) {
      record();
    }
  }

  /** Ends by itself when the session pauses. Where it fails the walk goes on without. */
  private void record() {
    RecordingConfig config = new RecordingConfig(session);
    config.setMp4DatasetUri(Uri.fromFile(dataset)).setAutoStopOnPause(true);
    try {
      session.startRecording(config);
    } catch (RecordingFailedException | RuntimeException e) {
      Log.w("vislam2tag", "ARCore does not record", e);
    }
  }

  @Override public void resize(int rotation, int width, int height) {
    session.setDisplayGeometry(rotation, width, height);
  }

  @Override public Frame update(Recorder recorder, Clocks clocks) throws CameraNotAvailableException {
    Frame frame = session.update();
    ClockReading arrival = clocks.read(); // at once: the frame's delay is measured by it
    if (recorder != null && frame.getTimestamp() != lastNs) { // the screen is often quicker than the camera
      lastNs = frame.getTimestamp();
      recorder.frame(ArFrames.frame(frame, session.getAllTrackables(AugmentedImage.class), arrival), anchors);
    }
    return frame;
  }

  @Override public void pause() {
    session.pause();
  }

  @Override public void close() {
    session.close();
  }
}
