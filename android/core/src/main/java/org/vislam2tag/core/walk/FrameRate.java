package org.vislam2tag.core.walk;

import java.util.ArrayDeque;
import java.util.Deque;

/** Frames a second, over the last two. */
public final class FrameRate {
  private static final long MEAN_NS = 2_000_000_000L;

  private final Deque<Long> timesNs = new ArrayDeque<>();

  /** A frame was got at {@code timeNs} on the boot clock. */
  public void frame(long timeNs) {
    timesNs.addLast(timeNs);
    forget(timeNs);
  }

  /** Frames a second as of {@code nowNs}; 0 when none comes any more. */
  public double hertz(long nowNs) {
    forget(nowNs);
    return timesNs.size() < 2 ? 0 : (timesNs.size() - 1) * 1e9 / (timesNs.peekLast() - timesNs.peekFirst());
  }

  private void forget(long nowNs) {
    while (!timesNs.isEmpty() && nowNs - timesNs.peekFirst() > MEAN_NS) {
      timesNs.removeFirst();
    }
  }
}
