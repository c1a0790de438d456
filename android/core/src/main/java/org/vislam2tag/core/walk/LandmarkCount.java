package org.vislam2tag.core.walk;

import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import org.vislam2tag.core.record.TrackedImage;

/** Which landmarks were seen, and how long ago and how far back the last of them was. */
public final class LandmarkCount {
  /** So long out of view a landmark is caught anew when it comes again, ns. */
  private static final long AWAY_NS = 5_000_000_000L;

  private final Map<String, Long> seenNs = new HashMap<>();
  private final List<String> caught = new ArrayList<>();
  private Stretch sofar;
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
        Long before = seenNs.put(image.id, timeNs);
        if (before == null || timeNs - before >= AWAY_NS) {
          caught.add(image.id);
        }
        sofar = worst(walkedM, image.id);
        lastId = image.id;
        lastNs = timeNs;
        lastM = walkedM;
      }
    }
  }

  /** How many different ones. */
  public int seen() {
    return seenNs.size();
  }

  /** Those that came into view since this was called last. */
  public List<String> takeCaught() {
    List<String> taken = new ArrayList<>(caught);
    caught.clear();
    return taken;
  }

  /** The way without one that leaves positions least sure: between two, from the start to the first, or since the last. */
  public Stretch worst(double walkedM) {
    return worst(walkedM, null);
  }

  private Stretch worst(double walkedM, String next) {
    Stretch now = new Stretch(metresSince(walkedM), lastId, next);
    return sofar != null && sofar.sigmaM() >= now.sigmaM() ? sofar : now;
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
