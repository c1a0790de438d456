package org.vislam2tag.core.walk;

import java.util.Set;
import org.vislam2tag.core.record.TrackingState;

/** What the screen shows of the walk; a copy that does not change. */
public final class WalkStatus {
  /** Walked, m. */
  public final double walkedM;
  /** Mean over the last second, m/s; 0 while no frames come. */
  public final double speedMps;
  /** Camera frames a second over the last two seconds. */
  public final double framesPerS;
  /** Of the last frame; null before the first and while none come. */
  public final TrackingState tracking;
  /** ARCore's {@code TrackingFailureReason} of the last frame; {@code NONE} where there is none. */
  public final String failure;
  /** For how long there has been no tracked frame, s; 0 while it tracks. */
  public final double lostS;
  /** In all, s: between frames that are not both tracked, or not close to each other. */
  public final double lostInAllS;
  /** Different landmarks seen. */
  public final int landmarksSeen;
  /** The last one's id; null before the first. */
  public final String lastLandmark;
  /** Since the last landmark was in view, before the first since the start: s and m. */
  public final double sinceLandmarkS;
  public final double sinceLandmarkM;
  /** The way without a landmark that leaves positions least sure. */
  public final Stretch worst;
  /** The warnings that are on. */
  public final Set<Warning> warnings;

  WalkStatus(Walk walk, long nowNs) {
    walkedM = walk.motion.metres();
    speedMps = walk.speedMps(nowNs);
    framesPerS = walk.rate.hertz(nowNs);
    tracking = walk.framesCome(nowNs) ? walk.last.state : null;
    failure = walk.last == null ? "NONE" : walk.last.failure;
    lostS = walk.lostS(nowNs);
    lostInAllS = walk.lostInAllS(nowNs);
    landmarksSeen = walk.landmarks.seen();
    lastLandmark = walk.landmarks.lastId();
    sinceLandmarkS = walk.landmarks.secondsSince(nowNs);
    sinceLandmarkM = walk.landmarks.metresSince(walkedM);
    worst = walk.landmarks.worst(walkedM);
    warnings = walk.warnings.on();
  }
}
