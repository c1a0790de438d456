package org.vislam2tag.app.ar;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;

import com.google.ar.core.Frame;
import com.google.ar.core.exceptions.CameraNotAvailableException;
import com.google.ar.core.exceptions.DeadlineExceededException;
import com.google.ar.core.exceptions.FatalException;
import com.google.ar.core.exceptions.MissingGlContextException;
import com.google.ar.core.exceptions.SessionPausedException;
import com.google.ar.core.exceptions.TextureNotSetException;
import com.google.ar.core.exceptions.UnavailableApkTooOldException;
import java.io.File;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.atomic.AtomicInteger;
import org.junit.Test;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.session.Recorder;

public class CameraLoopTest {
  private final List<String> told = new ArrayList<>();
  private final AtomicInteger closed = new AtomicInteger();
  private long nowMs;
  private int opened;
  private int drawn;
  private Exception atOpening;
  private RuntimeException atResume;
  private Exception atUpdate;
  private RuntimeException atPause;

  private final class Fake implements Tracker {
    @Override public void resume(int texture, int rotation, int width, int height) {
      throwIf(atResume);
    }

    @Override public void resize(int rotation, int width, int height) {}

    @Override public Frame update(Recorder recorder, Clocks clocks) throws CameraNotAvailableException {
      if (atUpdate instanceof CameraNotAvailableException) {
        throw (CameraNotAvailableException) atUpdate;
      }
      throwIf((RuntimeException) atUpdate);
      return null;
    }

    @Override public void pause() {
      throwIf(atPause);
    }

    @Override public void close() {
      closed.incrementAndGet();
    }
  }

  private final CameraView.Host host = new CameraView.Host() {
    @Override public Recorder recorder() {
      return null;
    }

    @Override public LandmarkImages landmarks() {
      return LandmarkImages.none();
    }

    @Override public File dataset() {
      return null;
    }

    @Override public void cameraAvailable() {
      told.add("available");
    }

    @Override public void cameraUnavailable(String reason) {
      told.add(reason);
    }
  };

  private final CameraLoop loop = new CameraLoop(host, null, () -> {
    opened++;
    if (atOpening != null) {
      throw atOpening;
    }
    return new Fake();
  }, new CameraLoop.Screen() {
    @Override public void begin(Tracker tracker) throws CameraNotAvailableException {
      tracker.resume(0, 0, 0, 0);
    }

    @Override public void draw(Frame frame) {
      drawn++;
    }
  }, () -> nowMs);

  private static void throwIf(RuntimeException e) {
    if (e != null) {
      throw e;
    }
  }

  /** Turns until the tracker was made, or failed to be. */
  private void open() {
    int before = told.size();
    loop.want();
    while (told.size() == before) {
      loop.frame();
      Thread.yield();
    }
  }

  @Test public void framesAreDrawnOnceTheTrackerIsReady() {
    loop.frame();
    assertEquals("nobody looks yet", 0, opened);
    open();
    loop.frame();
    assertTrue(drawn > 0);
    assertEquals(Collections.singletonList("available"), told);
    assertFalse(loop.isPreparing());
  }

  @Test public void whateverIsThrownAtAFrameEndsThisTrackerOnly() {
    for (Exception each : Arrays.asList(new DeadlineExceededException(), new SessionPausedException(), new FatalException(),
        new MissingGlContextException(), new TextureNotSetException(), new IllegalStateException())) {
      told.clear();
      atUpdate = null;
      nowMs += CameraLoop.LONGEST_RETRY_MS;
      open();
      atUpdate = each;
      loop.frame();
      assertNull(loop.tracker());
      assertEquals(Arrays.asList("available", each.getClass().getSimpleName()), told);
    }
    atUpdate = new CameraNotAvailableException();
    nowMs += CameraLoop.LONGEST_RETRY_MS;
    open();
    loop.frame();
    assertEquals("camera in use", told.get(told.size() - 1));
  }

  @Test public void whatIsThrownAtItsBeginOrEndIsToldToo() {
    atResume = new IllegalArgumentException();
    open();
    assertNull(loop.tracker());
    atResume = null;
    nowMs += CameraLoop.LONGEST_RETRY_MS;
    open();
    atPause = new FatalException();
    loop.leave();
    assertEquals(Arrays.asList("IllegalArgumentException", "available", "screen, FatalException"), told);
  }

  @Test public void aTrackerThatCannotBeMadeIsTriedLessAndLessOften() {
    atOpening = new UnavailableApkTooOldException();
    open();
    nowMs += CameraLoop.RETRY_MS - 1;
    loop.frame();
    assertEquals(1, opened);
    nowMs += 1;
    open();
    nowMs += CameraLoop.RETRY_MS;
    loop.frame();
    assertEquals("the second wait is twice the first", 2, opened);
    nowMs += CameraLoop.RETRY_MS;
    open();
    assertEquals(3, opened);
  }

  @Test public void afterAGoodWhileTheWaitIsShortAgain() {
    atOpening = new UnavailableApkTooOldException();
    open();
    nowMs += CameraLoop.LONGEST_RETRY_MS;
    open();
    atOpening = null;
    nowMs += CameraLoop.LONGEST_RETRY_MS;
    open();
    nowMs += CameraLoop.GOOD_MS;
    loop.leave();
    nowMs += CameraLoop.RETRY_MS;
    open();
    assertEquals("available", told.get(told.size() - 1));
  }

  @Test public void oneThatWasMadeInVainIsClosed() throws Exception {
    loop.want();
    loop.frame();
    loop.leave();
    loop.release();
    CountDownLatch gone = new CountDownLatch(1);
    new Thread(() -> {
      while (closed.get() == 0) {
        Thread.yield();
      }
      gone.countDown();
    }).start();
    gone.await();
    assertEquals(1, closed.get());
  }
}
