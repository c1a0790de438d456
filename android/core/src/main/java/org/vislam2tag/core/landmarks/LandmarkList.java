package org.vislam2tag.core.landmarks;

import java.util.Collections;
import java.util.List;

/** What a folder of landmarks holds: the images to look for, and those refused. */
public final class LandmarkList {
  public final List<Landmark> landmarks;
  public final List<Refusal> refusals;

  LandmarkList(List<Landmark> landmarks, List<Refusal> refusals) {
    this.landmarks = Collections.unmodifiableList(landmarks);
    this.refusals = Collections.unmodifiableList(refusals);
  }
}
