package org.vislam2tag.core.session;

import java.util.List;
import java.util.function.Consumer;
import org.vislam2tag.core.clock.FrameClock;
import org.vislam2tag.core.record.AnchorPose;
import org.vislam2tag.core.record.CameraPose;
import org.vislam2tag.core.record.Event;
import org.vislam2tag.core.record.LandmarkPose;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.tracking.AnchorHost;
import org.vislam2tag.core.tracking.AnchorTrail;
import org.vislam2tag.core.tracking.ImageRegister;
import org.vislam2tag.core.tracking.TrackingWatch;

/** Makes rows of camera frames: the frame's own, its landmarks', its anchors', and the events that they tell. */
final class FrameLog {
  /** Frames that were not logged are told at most this often, ns. */
  private static final long BACKWARD_TOLD_NS = 1_000_000_000L;

  /** A frame that was logged. */
  static final class Logged {
    /** When it was exposed, ns on the boot clock. */
    final long timeNs;
    /** The images that have a row. */
    final List<TrackedImage> images;
    final boolean beginsPart;

    Logged(long timeNs, List<TrackedImage> images, boolean beginsPart) {
      this.timeNs = timeNs;
      this.images = images;
      this.beginsPart = beginsPart;
    }
  }

  private final Consumer<Record> out;
  private final AnchorTrail anchors = new AnchorTrail();
  private final ImageRegister register = new ImageRegister();
  private final TrackingWatch tracking = new TrackingWatch();
  private FrameClock clock;
  private int part;
  private boolean partEmpty = true;
  private boolean partEnds;
  private long lastFrameNs;
  private long lastTimeNs = Long.MIN_VALUE;
  private int backward;
  private long backwardToldNs = Long.MIN_VALUE;

  FrameLog(Consumer<Record> out) {
    this.out = out;
  }

  /** Number of the tracking session, from 0. */
  int part() {
    return part;
  }

  /** The next frame is of a new tracking session, with a frame of its own. */
  void newPart() {
    partEnds = !partEmpty;
  }

  /** Logs a frame; null if it is not a new one, or not later than the last. */
  Logged log(TrackedFrame frame, AnchorHost host) {
    if (frame.frameNs == 0 || frame.frameNs == lastFrameNs) {
      return null;
    }
    lastFrameNs = frame.frameNs;
    int nextPart = partEnds ? part + 1 : part;
    CameraPose camera = new CameraPose(frame.arrival, frame.frameNs, nextPart, frame.state, frame.failure, frame.pose);
    if (camera.timeNs <= lastTimeNs) {
      backward++;
      tellBackward(frame.arrival.bootNs);
      return null;
    }
    lastTimeNs = camera.timeNs;
    boolean begins = beginPart(nextPart, camera.timeNs);
    tellClock(camera);
    Event change = tracking.at(frame, camera.timeNs);
    if (change != null) {
      out.accept(change);
    }
    out.accept(camera);
    List<TrackedImage> images = register.logged(frame.images);
    for (TrackedImage image : images) {
      out.accept(new LandmarkPose(camera.timeNs, image));
    }
    for (AnchorPose anchor : anchors.at(frame, camera.timeNs, host)) {
      out.accept(anchor);
    }
    return new Logged(camera.timeNs, images, begins);
  }

  /** Tells of frames not logged that were not told yet. */
  void finish(long nowNs) {
    if (backward > 0) {
      out.accept(new Event(nowNs, "frames_backward", Integer.toString(backward)));
      backward = 0;
    }
  }

  private boolean beginPart(int nextPart, long timeNs) {
    boolean begins = nextPart != part;
    if (begins) {
      part = nextPart;
      register.newPart();
      anchors.newPart();
      out.accept(new Event(timeNs, "part", Integer.toString(part)));
    }
    partEnds = false;
    partEmpty = false;
    return begins;
  }

  private void tellClock(CameraPose camera) {
    if (camera.clock() != clock) {
      clock = camera.clock();
      out.accept(new Event(camera.timeNs, "frame_clock", clock.word));
    }
  }

  private void tellBackward(long nowNs) {
    if (backwardToldNs == Long.MIN_VALUE || nowNs - backwardToldNs >= BACKWARD_TOLD_NS) {
      backwardToldNs = nowNs;
      finish(nowNs);
    }
  }
}
