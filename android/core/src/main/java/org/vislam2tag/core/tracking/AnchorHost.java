package org.vislam2tag.core.tracking;

import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.TrackingState;

/** Sets and answers anchors: ARCore in the app, a script in tests. Called while a frame is being recorded. */
public interface AnchorHost {
  /** Where an anchor is in the current frame. */
  final class State {
    public final TrackingState state;
    public final Pose pose;

    public State(TrackingState state, Pose pose) {
      this.state = state;
      this.pose = pose;
    }
  }

  /** Sets an anchor at a pose of the current frame; false where the tracker cannot now: it is tried again at the next. */
  boolean set(int number, Pose pose);

  /** Where an anchor that was set is now. */
  State get(int number);

  /** Lets an anchor go; one that it never set, as another part's host did, it ignores. */
  void detach(int number);
}
