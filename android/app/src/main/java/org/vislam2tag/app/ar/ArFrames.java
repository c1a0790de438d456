package org.vislam2tag.app.ar;

import com.google.ar.core.AugmentedImage;
import com.google.ar.core.Camera;
import com.google.ar.core.Frame;
import java.util.ArrayList;
import java.util.Collection;
import java.util.List;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;

/** Turns what ARCore answers into the core's words. */
final class ArFrames {
  private ArFrames() {}

  /** A frame, with all images that the session knows. */
  static TrackedFrame frame(Frame frame, Collection<AugmentedImage> images, ClockReading arrival) {
    Camera camera = frame.getCamera();
    List<TrackedImage> tracked = new ArrayList<>();
    for (AugmentedImage image : images) {
      tracked.add(image(image));
    }
    return new TrackedFrame(arrival, frame.getTimestamp(), state(camera.getTrackingState()),
        camera.getTrackingFailureReason().name(), pose(camera.getPose()), tracked);
  }

  /** A pose. */
  static Pose pose(com.google.ar.core.Pose pose) {
    return new Pose(pose.tx(), pose.ty(), pose.tz(), pose.qx(), pose.qy(), pose.qz(), pose.qw());
  }

  /** A pose for ARCore. */
  static com.google.ar.core.Pose arPose(Pose pose) {
    return new com.google.ar.core.Pose(new float[] {pose.txM, pose.tyM, pose.tzM},
        new float[] {pose.qx, pose.qy, pose.qz, pose.qw});
  }

  /** A state: the words are the same. */
  static TrackingState state(com.google.ar.core.TrackingState state) {
    return TrackingState.valueOf(state.name());
  }

  private static TrackedImage image(AugmentedImage image) {
    return new TrackedImage(image.getName(), state(image.getTrackingState()), image.getTrackingMethod().name(),
        pose(image.getCenterPose()), image.getExtentX(), image.getExtentZ());
  }
}
