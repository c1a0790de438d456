package org.vislam2tag.app.record;

import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.tracking.AnchorHost;

/** A tracker that sets no anchors. */
final class NoAnchors implements AnchorHost {
  @Override public boolean set(int number, Pose pose) {
    return false;
  }

  @Override public State get(int number) {
    throw new AssertionError("none was set");
  }

  @Override public void detach(int number) {}
}
