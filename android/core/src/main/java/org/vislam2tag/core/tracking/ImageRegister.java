package org.vislam2tag.core.tracking;

import java.util.ArrayList;
import java.util.HashSet;
import java.util.List;
import java.util.Set;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;

/**
 * Decides which images have a row at a frame: those that have been tracked in this part, until the tracker has let them
 * go, and the frame of that once (docs/reference/phone-tables.md, LandmarkPose.csv).
 */
public final class ImageRegister {
  private final Set<String> known = new HashSet<>();

  /** Of the images that the tracker reports in a frame those that are logged; one for an id. */
  public List<TrackedImage> logged(List<TrackedImage> reported) {
    List<TrackedImage> logged = new ArrayList<>();
    Set<String> inFrame = new HashSet<>();
    for (TrackedImage image : reported) {
      if (image.state == TrackingState.TRACKING) {
        known.add(image.id);
      }
      if (known.contains(image.id) && inFrame.add(image.id)) {
        logged.add(image);
      }
      if (image.state == TrackingState.STOPPED) {
        known.remove(image.id);
      }
    }
    return logged;
  }

  /** A new part begins, in which nothing has been seen yet. */
  public void newPart() {
    known.clear();
  }
}
