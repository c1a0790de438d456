package org.vislam2tag.app.ar;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.when;

import com.google.ar.core.AugmentedImage;
import com.google.ar.core.Camera;
import com.google.ar.core.Frame;
import com.google.ar.core.Pose;
import com.google.ar.core.TrackingFailureReason;
import com.google.ar.core.TrackingState;
import java.util.Collections;
import org.junit.Test;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;

public class ArFramesTest {
  private static final Pose POSE = new Pose(new float[] {1, 2, 3}, new float[] {0, 0.6f, 0, 0.8f});

  @Test public void aFrameKeepsStampStateReasonAndPose() {
    Frame frame = frame(TrackingState.PAUSED, TrackingFailureReason.EXCESSIVE_MOTION);
    ClockReading arrival = new ClockReading(7, 8, 9);
    TrackedFrame tracked = ArFrames.frame(frame, Collections.emptyList(), arrival);
    assertEquals(123456789L, tracked.frameNs);
    assertEquals("EXCESSIVE_MOTION", tracked.failure);
    assertFalse(tracked.isTracking());
    assertEquals(arrival, tracked.arrival);
    assertEquals(3, tracked.pose.tzM, 0);
    assertEquals(0.6, tracked.pose.qy, 1e-6);
  }

  @Test public void anImageKeepsIdMethodAndSize() {
    AugmentedImage image = mock(AugmentedImage.class);
    when(image.getName()).thenReturn("12");
    when(image.getTrackingState()).thenReturn(TrackingState.TRACKING);
    when(image.getTrackingMethod()).thenReturn(AugmentedImage.TrackingMethod.LAST_KNOWN_POSE);
    when(image.getCenterPose()).thenReturn(POSE);
    when(image.getExtentX()).thenReturn(0.2f);
    TrackedImage tracked = ArFrames.frame(frame(TrackingState.TRACKING, TrackingFailureReason.NONE),
        Collections.singleton(image), new ClockReading(0, 0, 0)).images.get(0);
    assertEquals("12", tracked.id);
    assertEquals("LAST_KNOWN_POSE", tracked.method);
    assertFalse(tracked.isSeenNow());
    assertEquals(0.2f, tracked.extentXM, 0);
    when(image.getTrackingMethod()).thenReturn(AugmentedImage.TrackingMethod.FULL_TRACKING);
    assertTrue(ArFrames.frame(frame(TrackingState.TRACKING, TrackingFailureReason.NONE), Collections.singleton(image),
        new ClockReading(0, 0, 0)).images.get(0).isSeenNow());
  }

  @Test public void everyStateOfArCoreHasItsWord() {
    for (TrackingState state : TrackingState.values()) {
      assertEquals(state.name(), ArFrames.state(state).name());
    }
  }

  @Test public void posesGoThereAndBack() {
    Pose back = ArFrames.arPose(ArFrames.pose(POSE));
    assertEquals(POSE.ty(), back.ty(), 0);
    assertEquals(POSE.qw(), back.qw(), 1e-6);
  }

  private static Frame frame(TrackingState state, TrackingFailureReason reason) {
    Camera camera = mock(Camera.class);
    when(camera.getTrackingState()).thenReturn(state);
    when(camera.getTrackingFailureReason()).thenReturn(reason);
    when(camera.getPose()).thenReturn(POSE);
    Frame frame = mock(Frame.class);
    when(frame.getCamera()).thenReturn(camera);
    when(frame.getTimestamp()).thenReturn(123456789L);
    return frame;
  }
}
