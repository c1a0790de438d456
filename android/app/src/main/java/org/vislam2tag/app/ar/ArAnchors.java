package org.vislam2tag.app.ar;

import com.google.ar.core.Anchor;
import com.google.ar.core.Session;
import com.google.ar.core.exceptions.FatalException;
import com.google.ar.core.exceptions.NotTrackingException;
import com.google.ar.core.exceptions.ResourceExhaustedException;
import com.google.ar.core.exceptions.SessionPausedException;
import java.util.HashMap;
import java.util.Map;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.tracking.AnchorHost;

/** Anchors of one ARCore session. */
final class ArAnchors implements AnchorHost {
  private final Session session;
  private final Map<Integer, Anchor> anchors = new HashMap<>();

  ArAnchors(Session session) {
    this.session = session;
  }

  @Override public boolean set(int number, Pose pose) {
    try {
      anchors.put(number, session.createAnchor(ArFrames.arPose(pose)));
      return true;
    } catch (NotTrackingException | SessionPausedException | ResourceExhaustedException | FatalException e) {
      return false;
    }
  }

  @Override public State get(int number) {
    Anchor anchor = anchors.get(number);
    return new State(ArFrames.state(anchor.getTrackingState()), ArFrames.pose(anchor.getPose()));
  }

  @Override public void detach(int number) {
    Anchor anchor = anchors.remove(number);
    if (anchor != null) {
      anchor.detach();
    }
  }
}
