package org.vislam2tag.core.walk;

import java.util.HashSet;
import java.util.List;
import java.util.Set;
import org.vislam2tag.core.record.TrackedImage;

/** Which landmarks were seen, and how long ago and how far back the last of them was. */
public final class LandmarkCount {
  private final Set<String> seen = new HashSet<>();
  private String lastId;
  private long lastNs;
  private double lastM;

  /** Before the first landmark time and way count from the start, {@code startNs} on the boot clock. */
  public LandmarkCount(long startNs) {
    lastNs = startNs;
  }

  /** The first frame is there: time counts from {@code timeNs} on. */
  void begin(long timeNs) {
    lastNs = timeNs;
  }

  /** The images of a frame, at {@code timeNs} on the boot clock and {@code walkedM} metres into the walk. */
  public void at(long timeNs, double walkedM, List<TrackedImage> images) {
    for (TrackedImage image : images) {
      if (image.isSeenNow()) {
        seen.add(image.id);
        lastId = image.id;
        lastNs = timeNs;
        lastM = walkedM;
      }
    }
  }

  /** How many different ones. */
  public int seen() {
    return seen.size();
  }

  /** The id of the last; null before the first. */
  public String lastId() {
    return lastId;
  }

  /** Seconds since the last. */
  public double secondsSince(long nowNs) {
    return Math.max(0, nowNs - lastNs) / 1e9;
  }

  /** Metres walked since the last. */
  public double metresSince(double walkedM) {
    return walkedM - lastM;
  }
}
