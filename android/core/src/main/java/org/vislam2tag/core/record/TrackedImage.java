package org.vislam2tag.core.record;

/** A landmark's image as the tracker reports it in a frame. */
public final class TrackedImage {
  /** The method of an image that is seen in this very frame. */
  public static final String SEEN_NOW = "FULL_TRACKING";

  /** The landmark's id in the manifest. */
  public final String id;
  public final TrackingState state;
  /** ARCore's {@code TrackingMethod}. */
  public final String method;
  /** Centre: +X right along the sheet, +Y out of it, +Z down it. */
  public final Pose pose;
  /** Size as the tracker estimates it, m; 0 where it does not. */
  public final float extentXM;
  public final float extentZM;

  public TrackedImage(String id, TrackingState state, String method, Pose pose, float extentXM, float extentZM) {
    this.id = id;
    this.state = state;
    this.method = method;
    this.pose = pose;
    this.extentXM = extentXM;
    this.extentZM = extentZM;
  }

  /** Is it in the camera's view, and not only remembered? */
  public boolean isSeenNow() {
    return state == TrackingState.TRACKING && SEEN_NOW.equals(method);
  }
}
