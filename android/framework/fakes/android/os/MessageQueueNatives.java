package android.os;

import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;
import java.util.concurrent.Semaphore;
import java.util.concurrent.TimeUnit;
import java.util.concurrent.atomic.AtomicLong;

/** Sleeps until a time or until it is woken, as Android's epoll does; it watches no files. */
final class MessageQueueNatives {
  private static final AtomicLong LAST = new AtomicLong();
  private static final Map<Long, Semaphore> WAKES = new ConcurrentHashMap<>();

  private MessageQueueNatives() {}

  static long nativeInit() {
    long queue = LAST.incrementAndGet();
    WAKES.put(queue, new Semaphore(0));
    return queue;
  }

  static void nativeDestroy(long queue) {
    WAKES.remove(queue);
  }

  static void nativePollOnce(MessageQueue self, long queue, int timeoutMs) {
    Semaphore wake = WAKES.get(queue);
    try {
      if (timeoutMs < 0) {
        wake.acquire();
      } else {
        wake.tryAcquire(timeoutMs, TimeUnit.MILLISECONDS);
      }
      wake.drainPermits();
    } catch (InterruptedException e) {
      Thread.currentThread().interrupt();
    }
  }

  static void nativeWake(long queue) {
    Semaphore wake = WAKES.get(queue);
    if (wake != null) {
      wake.release();
    }
  }
}
