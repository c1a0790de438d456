package org.vislam2tag.core.walk;

import java.util.Collections;
import java.util.List;
import java.util.Set;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;

/** The walk so far: what the screen shows of it, and when it warns. */
public final class Walk {
  /** The tracker takes this long to begin without being called lost, s. */
  static final double BEGIN_S = 5;
  /** No frame for this long: tracking is lost, ns. */
  static final long NO_FRAME_NS = 500_000_000L;

  final Motion motion = new Motion();
  final FrameRate rate = new FrameRate();
  private final WalkMap map = new WalkMap();
  private final boolean looksForLandmarks;
  final LandmarkCount landmarks;
  final Warnings warnings;
  private long lastTrackedNs;
  private boolean everTracked;
  private long lostNs;
  private long lastArrivedNs = Long.MIN_VALUE;
  TrackedFrame last;

  /** Starts at {@code startNs} on the boot clock; nobody is sent to a landmark where the tracker knows none. */
  public Walk(WarningSettings settings, long startNs, boolean looksForLandmarks) {
    this.looksForLandmarks = looksForLandmarks;
    warnings = new Warnings(settings);
    landmarks = new LandmarkCount(startNs);
    lastTrackedNs = startNs;
  }

  /** A frame was logged with these images; {@code beginsPart} if its frame of reference is a new one. */
  public void frame(TrackedFrame frame, long timeNs, List<TrackedImage> images, boolean beginsPart) {
    if (last == null) { // the tracker may have been made ready for minutes: nothing was lost in them
      lastTrackedNs = frame.arrival.bootNs;
      landmarks.begin(frame.arrival.bootNs);
    }
    if (last != null && !(last.isTracking() && frame.isTracking() && framesCome(frame.arrival.bootNs))) {
      lostNs += frame.arrival.bootNs - lastArrivedNs;
    }
    last = frame;
    lastArrivedNs = frame.arrival.bootNs;
    rate.frame(timeNs);
    if (beginsPart) {
      motion.broke();
      map.newPart();
    }
    if (frame.isTracking()) {
      everTracked = true;
      lastTrackedNs = frame.arrival.bootNs;
      motion.at(timeNs, frame.pose);
      map.at(frame.pose);
      map.landmarks(images);
      landmarks.at(frame.arrival.bootNs, motion.metres(), images);
    } else {
      broke();
    }
  }

  /** The way from the last pose to the next is not known. */
  public void broke() {
    motion.broke();
    map.broke();
  }

  /** Looks at the walk again; the warnings that come on: none before the first frame. */
  public Set<Warning> warnings(long nowNs) {
    if (last == null) {
      return Collections.emptySet();
    }
    double sinceS = looksForLandmarks ? landmarks.secondsSince(nowNs) : 0;
    double sinceM = looksForLandmarks ? landmarks.metresSince(motion.metres()) : 0;
    double graceS = everTracked ? 0 : BEGIN_S;
    return warnings.update(sinceS, sinceM, lostS(nowNs) - graceS, speedMps(nowNs),
        framesCome(nowNs) ? motion.turningRadps() : 0);
  }

  /** Landmarks that came into view since this was called last. */
  public List<String> takeCaught() {
    return landmarks.takeCaught();
  }

  /** The map of the walk. */
  public WalkMap map() {
    return map;
  }

  /** What is known now. */
  public WalkStatus status(long nowNs) {
    return new WalkStatus(this, nowNs);
  }

  boolean framesCome(long nowNs) {
    return last != null && nowNs - lastArrivedNs < NO_FRAME_NS;
  }

  double speedMps(long nowNs) {
    return framesCome(nowNs) ? motion.speedMps() : 0;
  }

  /** In all, from the first frame on, s. */
  double lostInAllS(long nowNs) {
    return (lostNs + (last == null || framesCome(nowNs) ? 0 : nowNs - lastArrivedNs)) / 1e9;
  }

  double lostS(long nowNs) {
    return framesCome(nowNs) && last.isTracking() ? 0 : Math.max(0, nowNs - lastTrackedNs) / 1e9;
  }
}
