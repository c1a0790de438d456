package org.vislam2tag.core.tracking;

import java.util.Locale;
import org.vislam2tag.core.record.Event;
import org.vislam2tag.core.record.TrackedFrame;

/** Notices when the tracker loses the camera's pose and when it has it again. */
public final class TrackingWatch {
  private boolean tracked;
  private boolean lost;
  private long lostNs;

  /** The event of this frame; null where nothing changed. */
  public Event at(TrackedFrame frame, long timeNs) {
    boolean before = tracked;
    tracked = frame.isTracking();
    if (before && !tracked) {
      lost = true;
      lostNs = timeNs;
      return new Event(timeNs, "tracking_lost", frame.failure);
    }
    if (lost && tracked) {
      lost = false;
      return new Event(timeNs, "tracking_found", String.format(Locale.ROOT, "%.1f", (timeNs - lostNs) / 1e9));
    }
    return null;
  }
}
