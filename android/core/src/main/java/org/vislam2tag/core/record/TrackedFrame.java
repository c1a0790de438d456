package org.vislam2tag.core.record;

import java.util.Collections;
import java.util.List;
import org.vislam2tag.core.clock.ClockReading;

/** What the tracker answers for one camera frame. */
public final class TrackedFrame {
  /** The clocks when the app got the frame. */
  public final ClockReading arrival;
  /** The tracker's stamp, ns on whatever clock. */
  public final long frameNs;
  public final TrackingState state;
  /** ARCore's {@code TrackingFailureReason}. */
  public final String failure;
  public final Pose pose;
  /** All images that the tracker reports, whatever their state. */
  public final List<TrackedImage> images;

  public TrackedFrame(ClockReading arrival, long frameNs, TrackingState state, String failure, Pose pose,
      List<TrackedImage> images) {
    this.arrival = arrival;
    this.frameNs = frameNs;
    this.state = state;
    this.failure = failure;
    this.pose = pose;
    this.images = Collections.unmodifiableList(images);
  }

  /** Has the camera a pose? */
  public boolean isTracking() {
    return state == TrackingState.TRACKING;
  }
}
