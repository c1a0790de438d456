package org.vislam2tag.core.tracking;

import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.Deque;
import java.util.List;
import org.vislam2tag.core.record.AnchorPose;
import org.vislam2tag.core.record.TrackedFrame;

/**
 * Leaves an anchor behind every few metres and follows the newest ones. Anchors move only when the tracker rewrites its
 * map, so their poses show that between landmarks too (docs/reference/phone-tables.md, AnchorPose.csv).
 */
public final class AnchorTrail {
  /** An anchor is set when the camera is this far from the newest, m. */
  static final double SPACING_M = 5;
  /** So many newest anchors are followed. */
  static final int FOLLOWED = 8;

  private final Deque<Integer> followed = new ArrayDeque<>();
  private final List<Integer> abandoned = new ArrayList<>();
  private int next;

  /** Sets an anchor where one is due, and tells where those followed are. */
  public List<AnchorPose> at(TrackedFrame frame, long timeNs, AnchorHost host) {
    for (int number : abandoned) {
      host.detach(number);
    }
    abandoned.clear();
    if (frame.isTracking() && isDue(frame, host) && host.set(next, frame.pose)) {
      followed.addLast(next++);
      if (followed.size() > FOLLOWED) {
        host.detach(followed.removeFirst());
      }
    }
    List<AnchorPose> poses = new ArrayList<>();
    for (int number : followed) {
      AnchorHost.State anchor = host.get(number);
      poses.add(new AnchorPose(timeNs, number, anchor.state, anchor.pose));
    }
    return poses;
  }

  /** A new part begins: the old part's anchors mean nothing in it. Their numbers are not used again. */
  public void newPart() {
    abandoned.addAll(followed);
    followed.clear();
  }

  private boolean isDue(TrackedFrame frame, AnchorHost host) {
    return followed.isEmpty() || host.get(followed.getLast()).pose.distanceM(frame.pose) >= SPACING_M;
  }
}
