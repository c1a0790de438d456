package android.os;

import java.util.concurrent.atomic.AtomicLong;

/** The phone's clock: the JVM's own, and what a test lets pass besides. */
public final class SystemClockNatives {
  private static final AtomicLong PASSED_NS = new AtomicLong();

  private SystemClockNatives() {}

  /** Lets time pass at once. */
  public static void pass(long ms) {
    PASSED_NS.addAndGet(ms * 1_000_000);
  }

  static long uptimeMillis() {
    return elapsedRealtimeNanos() / 1_000_000;
  }

  static long elapsedRealtime() {
    return elapsedRealtimeNanos() / 1_000_000;
  }

  static long elapsedRealtimeNanos() {
    return System.nanoTime() + PASSED_NS.get();
  }
}
