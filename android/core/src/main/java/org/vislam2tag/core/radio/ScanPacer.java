package org.vislam2tag.core.radio;

import java.util.ArrayDeque;
import java.util.Deque;

/**
 * Says when to ask for the next Wi-Fi scan: as soon as the last one is in; where the platform throttles, evenly, four
 * in two minutes (Android 9 and later, in the foreground). Whether it throttles is told, or seen from a refusal.
 */
public final class ScanPacer {
  /** What Android allows within {@link #WINDOW_NS}. */
  static final int ALLOWED = 4;
  static final long WINDOW_NS = 120_000_000_000L;
  /** A scan that did not end after this time never will, ns. */
  static final long LONGEST_SCAN_NS = 15_000_000_000L;
  /** Between a scan's results and the next scan, ns. */
  static final long PAUSE_NS = 500_000_000L;
  /** After a refusal without throttling (Wi-Fi just off, for instance), ns. */
  static final long RETRY_NS = 5_000_000_000L;

  private final Deque<Long> askedNs = new ArrayDeque<>();
  private boolean throttled;
  private long notBeforeNs = Long.MIN_VALUE;

  /** Is it time to ask for a scan, at {@code nowNs} on the boot clock? */
  public boolean isDue(long nowNs) {
    return nowNs >= notBeforeNs;
  }

  /** A scan was asked for, and accepted or refused. */
  public void asked(long nowNs, boolean accepted) {
    if (accepted) {
      askedNs.addLast(nowNs);
    } else if (inWindow(nowNs) >= ALLOWED) {
      throttled = true;
    }
    long waitNs = accepted ? LONGEST_SCAN_NS : RETRY_NS;
    notBeforeNs = Math.max(nowNs + waitNs, throttled ? evenlyNs(nowNs, accepted) : nowNs);
  }

  /** Results arrived. */
  public void delivered(long nowNs) {
    if (!throttled) {
      notBeforeNs = nowNs + PAUSE_NS;
    }
  }

  /** The platform tells whether it throttles. */
  public void throttling(boolean on) {
    if (throttled && !on) {
      notBeforeNs = Long.MIN_VALUE;
    }
    throttled = on;
  }

  /** Is the pace held down, as the platform said or as its refusals show? */
  public boolean isThrottled() {
    return throttled;
  }

  private long evenlyNs(long nowNs, boolean accepted) {
    if (!accepted && inWindow(nowNs) >= ALLOWED) {
      return askedNs.peekFirst() + WINDOW_NS;
    }
    return nowNs + WINDOW_NS / ALLOWED;
  }

  private int inWindow(long nowNs) {
    while (!askedNs.isEmpty() && nowNs - askedNs.peekFirst() >= WINDOW_NS) {
      askedNs.removeFirst();
    }
    return askedNs.size();
  }
}
