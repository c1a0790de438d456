package org.vislam2tag.app.ar;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;
import static org.mockito.ArgumentMatchers.any;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.never;
import static org.mockito.Mockito.verify;
import static org.mockito.Mockito.when;

import com.google.ar.core.Anchor;
import com.google.ar.core.Pose;
import com.google.ar.core.Session;
import com.google.ar.core.TrackingState;
import com.google.ar.core.exceptions.NotTrackingException;
import org.junit.Test;
import org.vislam2tag.core.tracking.AnchorHost;

public class ArAnchorsTest {
  private static final org.vislam2tag.core.record.Pose HERE = new org.vislam2tag.core.record.Pose(1, 2, 3, 0, 0, 0, 1);

  private final Session session = mock(Session.class);
  private final Anchor anchor = mock(Anchor.class);
  private final ArAnchors anchors = new ArAnchors(session);

  @Test public void anAnchorIsSetAnsweredAndLetGo() {
    when(session.createAnchor(any())).thenReturn(anchor);
    when(anchor.getTrackingState()).thenReturn(TrackingState.TRACKING);
    when(anchor.getPose()).thenReturn(new Pose(new float[] {1.5f, 2, 3}, new float[] {0, 0, 0, 1}));
    assertTrue(anchors.set(4, HERE));
    AnchorHost.State state = anchors.get(4);
    assertEquals(1.5f, state.pose.txM, 0);
    anchors.detach(4);
    verify(anchor).detach();
  }

  @Test public void aTrackerThatCannotIsAskedAgainLater() {
    when(session.createAnchor(any())).thenThrow(new NotTrackingException());
    assertFalse(anchors.set(0, HERE));
  }

  @Test public void anAnchorOfAnotherPartIsIgnored() {
    anchors.detach(7);
    verify(anchor, never()).detach();
  }
}
