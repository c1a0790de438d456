package org.vislam2tag.app.ar;

import com.google.ar.core.Frame;
import com.google.ar.core.exceptions.CameraNotAvailableException;
import java.util.concurrent.Callable;
import java.util.concurrent.ExecutionException;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;
import java.util.concurrent.Future;
import java.util.function.LongSupplier;
import org.vislam2tag.core.clock.Clocks;

/**
 * The tracker's life: it is made ready, runs frame by frame, and is made again after it ended or failed, whatever ARCore
 * throws: Wi-Fi and sensors go on meanwhile. All is called on the GL thread but {@link #isPreparing} and {@link #release}.
 */
final class CameraLoop {
  /** The picture on the screen. */
  interface Screen {
    /** Gives the tracker its texture and starts the camera. */
    void begin(Tracker tracker) throws CameraNotAvailableException;

    /** Draws a frame. */
    void draw(Frame frame);
  }

  /** The wait before the tracker is made again; it doubles up to the longest while it fails at once. */
  static final long RETRY_MS = 1000;
  static final long LONGEST_RETRY_MS = 60_000;
  /** One that ran for so long did not fail at once. */
  static final long GOOD_MS = 10_000;

  private final CameraView.Host host;
  private final Clocks clocks;
  private final Callable<Tracker> opener;
  private final Screen screen;
  private final LongSupplier nowMs;
  /** Makes and ends trackers, which may take seconds, one after the other. */
  private final ExecutorService work = Executors.newSingleThreadExecutor();
  private volatile Future<Tracker> opening;
  private Tracker tracker;
  private boolean wanted;
  private long begunMs;
  private long notBeforeMs;
  private long waitMs = RETRY_MS;

  CameraLoop(CameraView.Host host, Clocks clocks, Callable<Tracker> opener, Screen screen, LongSupplier nowMs) {
    this.host = host;
    this.clocks = clocks;
    this.opener = opener;
    this.screen = screen;
    this.nowMs = nowMs;
  }

  /** Is the tracker being made ready? */
  boolean isPreparing() {
    return opening != null;
  }

  /** The one that runs, or null. */
  Tracker tracker() {
    return tracker;
  }

  /** The picture is looked at. */
  void want() {
    wanted = true;
  }

  /** The picture is not looked at any more. */
  void leave() {
    wanted = false;
    close("screen");
  }

  /** One turn: the newest frame is recorded and drawn, where the tracker runs. */
  void frame() {
    if (tracker == null && wanted && nowMs.getAsLong() >= notBeforeMs) {
      open();
    }
    if (tracker == null) {
      return;
    }
    try {
      screen.draw(tracker.update(host.recorder(), clocks));
    } catch (CameraNotAvailableException e) {
      close("camera in use");
    } catch (RuntimeException e) { // of more kinds than ARCore's pages name
      close(e.getClass().getSimpleName());
    }
  }

  /** Ends the tracker that runs, for a reason in the words of the log. */
  void close(String reason) {
    if (tracker == null) {
      return;
    }
    Tracker over = tracker;
    tracker = null;
    if (nowMs.getAsLong() - begunMs >= GOOD_MS) {
      waitMs = RETRY_MS;
    }
    try {
      over.pause();
    } catch (RuntimeException e) {
      reason += ", " + e.getClass().getSimpleName();
    }
    failed(over, reason);
  }

  /** Nothing is called any more; after the last {@link #leave}. */
  void release() {
    Future<Tracker> unused = opening;
    work.execute(() -> closeUnused(unused));
    work.shutdown();
  }

  private void open() {
    if (opening == null) {
      opening = work.submit(opener);
    } else if (opening.isDone()) {
      begin(opening);
      opening = null;
    }
  }

  private void begin(Future<Tracker> made) {
    Tracker opened = null;
    try {
      opened = made.get();
      screen.begin(opened);
      tracker = opened;
      begunMs = nowMs.getAsLong();
      host.cameraAvailable();
    } catch (ExecutionException e) {
      failed(null, e.getCause().getClass().getSimpleName());
    } catch (CameraNotAvailableException | RuntimeException e) {
      tracker = null;
      failed(opened, e.getClass().getSimpleName());
    } catch (InterruptedException e) {
      Thread.currentThread().interrupt(); // it was done: nothing is waited for
    }
  }

  private void failed(Tracker over, String reason) {
    if (over != null) {
      work.execute(over::close);
    }
    notBeforeMs = nowMs.getAsLong() + waitMs;
    waitMs = Math.min(2 * waitMs, LONGEST_RETRY_MS);
    host.cameraUnavailable(reason);
  }

  private static void closeUnused(Future<Tracker> made) {
    if (made == null) {
      return;
    }
    try {
      made.get().close();
    } catch (ExecutionException e) {
      return; // there is none to close
    } catch (InterruptedException e) {
      Thread.currentThread().interrupt();
    }
  }
}
