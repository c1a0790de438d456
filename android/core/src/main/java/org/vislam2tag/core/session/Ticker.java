package org.vislam2tag.core.session;

import java.io.Closeable;

/** Calls {@link Recorder#tick} twice a second on a thread of its own, until the session ends or it is closed. */
public final class Ticker implements Closeable {
  private static final long PERIOD_MS = 500;

  private final Thread thread;
  private volatile boolean closed;

  /** Starts ticking. */
  public Ticker(Recorder recorder) {
    thread = new Thread(() -> run(recorder), "recorder");
    thread.setDaemon(true);
    thread.start();
  }

  /** Ticks no more; returns at once. */
  @Override public void close() {
    closed = true;
    thread.interrupt();
  }

  private void run(Recorder recorder) {
    while (!closed && !recorder.isEnded()) {
      try {
        recorder.tick();
        Thread.sleep(PERIOD_MS);
      } catch (InterruptedException e) {
        return;
      } catch (RuntimeException e) {
        recorder.crashed(e);
        throw e;
      }
    }
  }
}
