package org.vislam2tag.core.handover;

import java.io.IOException;
import java.util.List;
import org.vislam2tag.core.handover.UploadException.Cause;

/** Sends what waits in an outbox, one session after the other, and waits for a computer that is out of reach. */
public final class SendAll {
  /** Between two tries to reach the computer: doubled up to the longest, s. */
  static final int FIRST_WAIT_S = 5;
  static final int LONGEST_WAIT_S = 60;
  private static final long LOOK_MS = 500;

  /** Packs and sends one session. */
  public interface Courier {
    /** Returns where the computer filed it; null where the session is not on the phone any more. */
    String send(Receiver to, String session) throws UploadException, IOException, InterruptedException;
  }

  /** Waits; a test does not. */
  interface Pause {
    void milliseconds(long time) throws InterruptedException;
  }

  private final Outbox outbox;
  private final Courier courier;
  private final Pause pause;
  private volatile boolean stopped;

  public SendAll(Outbox outbox, Courier courier) {
    this(outbox, courier, Thread::sleep);
  }

  SendAll(Outbox outbox, Courier courier, Pause pause) {
    this.outbox = outbox;
    this.courier = courier;
    this.pause = pause;
  }

  /**
   * Returns when nothing waits any more, or {@link #stop} was called: what waits then stays in the outbox. A session that the
   * computer refuses does not keep the others.
   *
   * @throws UploadException if the computer takes none: another token, its disk is full, it is not understood
   * @throws IOException if a session cannot be packed, or the outbox not be kept
   */
  public void run() throws UploadException, IOException, InterruptedException {
    int waitS = FIRST_WAIT_S;
    for (List<String> waiting = outbox.waiting(); !waiting.isEmpty() && !stopped; waiting = outbox.waiting()) {
      if (one(waiting.get(0))) {
        waitS = FIRST_WAIT_S;
      } else {
        rest(waitS);
        waitS = Math.min(2 * waitS, LONGEST_WAIT_S);
      }
    }
  }

  /** No further session is begun; from any thread. */
  public void stop() {
    stopped = true;
  }

  /** Was {@link #stop} called? */
  public boolean isStopped() {
    return stopped;
  }

  /** False where the computer is out of reach. */
  private boolean one(String session) throws UploadException, IOException, InterruptedException {
    Receiver to = outbox.receiver();
    if (to == null) {
      return true; // what waited was taken back
    }
    try {
      String where = courier.send(to, session);
      if (where == null) {
        outbox.forget(session);
      } else {
        outbox.filed(session, where);
      }
      return true;
    } catch (UploadException e) {
      if (e.reason == Cause.REFUSED || e.reason == Cause.TOO_LARGE) {
        outbox.refused(session, e.getMessage());
      } else if (e.reason != Cause.NO_CONNECTION && e.reason != Cause.CANCELLED) {
        throw e;
      }
      return e.reason != Cause.NO_CONNECTION;
    }
  }

  private void rest(int seconds) throws InterruptedException {
    for (long left = seconds * 1000L; left > 0 && !stopped; left -= LOOK_MS) {
      pause.milliseconds(LOOK_MS);
    }
  }
}
