package org.vislam2tag.app.record;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertNotNull;
import static org.junit.Assert.assertTrue;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.when;

import android.app.Phone;
import android.app.Screen;
import android.content.ComponentName;
import android.content.ComponentCallbacks2;
import android.content.Context;
import android.content.Intent;
import android.content.ServiceConnection;
import android.os.IBinder;
import android.os.SystemClockNatives;
import android.view.ViewGroup;
import android.widget.TextView;
import com.google.ar.core.Anchor;
import com.google.ar.core.Camera;
import com.google.ar.core.Frame;
import com.google.ar.core.Pose;
import com.google.ar.core.Session;
import com.google.ar.core.TrackingFailureReason;
import com.google.ar.core.TrackingState;
import com.google.ar.core.exceptions.CameraNotAvailableException;
import com.google.ar.core.exceptions.DeadlineExceededException;
import com.google.ar.core.exceptions.FatalException;
import com.google.ar.core.exceptions.SessionPausedException;
import com.google.ar.core.exceptions.UnavailableArcoreNotInstalledException;
import java.io.File;
import java.nio.file.Files;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.concurrent.atomic.AtomicBoolean;
import java.util.concurrent.atomic.AtomicLong;
import org.junit.After;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.R;
import org.vislam2tag.app.ar.CameraView;
import org.vislam2tag.app.ar.LandmarkImages;
import org.vislam2tag.app.recording.Plan;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.core.session.EndState;
import org.vislam2tag.core.session.SessionEnd;

/** The record screen with Android's own GL view and thread, and a fake of ARCore. */
public class RecordActivityTest {
  private static final Pose POSE = new Pose(new float[3], new float[] {0, 0, 0, 1});

  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private Phone phone;
  private RecordingService.Link link;
  private Screen<RecordActivity> screen;
  private CameraView camera;

  @Before public void record() throws Exception {
    phone = Phone.usual(folder.getRoot());
    Session.reset(frame(), anchor());
    phone.context().bindService(new Intent(phone.context(), RecordingService.class), new ServiceConnection() {
      @Override public void onServiceConnected(ComponentName name, IBinder binder) {
        link = (RecordingService.Link) binder;
      }

      @Override public void onServiceDisconnected(ComponentName name) {}
    }, Context.BIND_AUTO_CREATE);
    phone.idle();
    link.start(new Plan("Site", 0, "LG", "", 100, LandmarkImages.none(), true, false, Collections.emptyList()));
  }

  @After public void end() throws Exception {
    if (screen != null && !screen.activity.isDestroyed()) {
      screen.pause().stop().destroy();
    }
    link.stop();
    phone.until("the recording's end", () -> link.recording() == null);
  }

  private static Frame frame() {
    Camera camera = mock(Camera.class);
    when(camera.getTrackingState()).thenReturn(TrackingState.TRACKING);
    when(camera.getTrackingFailureReason()).thenReturn(TrackingFailureReason.NONE);
    when(camera.getPose()).thenReturn(POSE);
    Frame frame = mock(Frame.class);
    AtomicLong stamp = new AtomicLong(1_000_000_000);
    when(frame.getCamera()).thenReturn(camera);
    when(frame.getTimestamp()).thenAnswer(call -> stamp.addAndGet(10_000_000));
    return frame;
  }

  private static Anchor anchor() {
    Anchor anchor = mock(Anchor.class);
    when(anchor.getTrackingState()).thenReturn(TrackingState.TRACKING);
    when(anchor.getPose()).thenReturn(POSE);
    return anchor;
  }

  /** Shows the screen, and the picture of the camera in it. */
  private void shown() throws Exception {
    screen = phone.open(RecordActivity.class, new Intent()).show();
    phone.idle();
    camera = (CameraView) ((ViewGroup) screen.activity.findViewById(R.id.camera)).getChildAt(0);
    surface();
  }

  private void surface() {
    camera.surfaceCreated(camera.getHolder());
    camera.surfaceChanged(camera.getHolder(), 0, 360, 640);
  }

  private void comes(String call, int times) throws InterruptedException {
    phone.until(times + " of " + call, () -> Collections.frequency(Session.CALLS, call) >= times);
  }

  private List<String> events() throws Exception {
    File session = new File(folder.getRoot(), "sessions").listFiles(File::isDirectory)[0];
    link.stop();
    phone.until("the recording's end", () -> link.recording() == null);
    return Files.readAllLines(new File(session, "Events.csv").toPath());
  }

  /** Lets the GL thread come to an end of waiting that the loop began, on the phone's clock. */
  private void trackerComesBack() throws InterruptedException {
    phone.until("a tracker again", () -> {
      SystemClockNatives.pass(1000);
      return Session.RESUMED.get() == 1;
    });
  }

  @Test public void framesOfTheGlThreadAreRecorded() throws Exception {
    shown();
    comes("update", 3);
    assertEquals(1, Session.RESUMED.get());
    assertTrue(link.recording().recorder().status().walk.framesPerS > 0);
  }

  @Test public void whateverArCoreThrowsAtWhateverCallTheWalkGoesOnAndTheCameraComesBack() throws Exception {
    shown();
    comes("update", 1);
    List<Throwable> all = Arrays.asList(new CameraNotAvailableException(), new DeadlineExceededException(),
        new SessionPausedException(), new FatalException(), new UnavailableArcoreNotInstalledException(),
        new IllegalStateException());
    for (String call : Arrays.asList("update", "getAllTrackables", "pause", "resume", "setDisplayGeometry", "configure", "Session")) {
      for (Throwable thrown : all) {
        boolean isDeclared = thrown instanceof RuntimeException
            || call.equals(thrown instanceof CameraNotAvailableException ? "resume" : "Session")
            || call.equals("update") && thrown instanceof CameraNotAvailableException;
        if (isDeclared) {
          throwOnce(call, thrown);
        }
      }
    }
    assertNotNull(link.recording());
    assertTrue(events().stream().anyMatch(row -> row.contains("DeadlineExceededException")));
  }

  /** ARCore throws this at the next call of this name; the running tracker ends for that, and another begins. */
  private void throwOnce(String call, Throwable thrown) throws InterruptedException {
    AtomicBoolean done = new AtomicBoolean();
    boolean isRunning = call.equals("update") || call.equals("getAllTrackables");
    AtomicBoolean ended = new AtomicBoolean(isRunning);
    Session.throwing = name -> {
      if (!ended.get() && name.equals("update")) {
        ended.set(true);
        return new SessionPausedException();
      }
      return ended.get() && name.equals(call) && done.compareAndSet(false, true) ? thrown : null;
    };
    phone.until(call + " throws " + thrown, () -> {
      SystemClockNatives.pass(1000);
      return done.get();
    });
    trackerComesBack();
  }

  @Test public void pausingGivesTheCameraBackAndEveryReturnBeginsAPart() throws Exception {
    shown();
    comes("update", 1);
    screen.pause();
    phone.until("the camera is given back", () -> Session.RESUMED.get() == 0);
    screen.resume();
    trackerComesBack();
    screen.pause().stop().restart();
    screen.resume();
    trackerComesBack();
    assertNotNull(link.recording());
    assertTrue(events().stream().filter(row -> row.contains("screen")).count() > 0);
  }

  @Test public void aScreenMadeAnewDoesNotSplitTheRecordingNorHoldTwoTrackers() throws Exception {
    shown();
    comes("update", 1);
    Object before = link.recording();
    isMadeAnew();
    trackerComesBack();
    assertEquals(before, link.recording());
  }

  private void isMadeAnew() throws Exception {
    screen = screen.recreate();
    phone.idle();
    camera = (CameraView) ((ViewGroup) screen.activity.findViewById(R.id.camera)).getChildAt(0);
    surface();
  }

  /** Every order of three of: a dialog above it, the home key, being made anew. */
  @Test public void inEveryOrderOfLeavingAndReturningOneTrackerHasTheCameraAndOneWalkGoesOn() throws Exception {
    shown();
    comes("update", 1);
    Object walk = link.recording();
    for (int order = 0; order < 27; order++) {
      for (int step = 0, rest = order; step < 3; step++, rest /= 3) {
        if (rest % 3 == 2) {
          isMadeAnew();
        } else {
          screen.pause();
          phone.until("the camera is given back", () -> Session.RESUMED.get() == 0);
          if (rest % 3 == 1) {
            screen.stop().restart();
          }
          screen.resume();
        }
        trackerComesBack();
        assertEquals(walk, link.recording());
      }
    }
  }

  @Test public void littleMemoryAndAPermissionTakenAwayEndNoRecording() throws Exception {
    shown();
    comes("update", 1);
    for (int level : new int[] {ComponentCallbacks2.TRIM_MEMORY_RUNNING_CRITICAL, ComponentCallbacks2.TRIM_MEMORY_COMPLETE}) {
      screen.activity.onTrimMemory(level);
      phone.running(RecordingService.class).onTrimMemory(level);
    }
    screen.activity.onLowMemory();
    phone.granted.clear();
    Session.throwing = call -> call.equals("update") ? new SecurityException("camera") : null;
    phone.until("the camera is lost", () -> Session.RESUMED.get() == 0);
    phone.pass(1000);
    assertNotNull(link.recording());
    assertTrue(events().stream().anyMatch(row -> row.contains("SecurityException")));
  }

  @Test public void aClockThatWasSetIsToldOnTheScreen() throws Exception {
    shown();
    TextView hints = screen.activity.findViewById(R.id.hints);
    String told = screen.activity.getString(R.string.status_clock_changed, 0.0).substring(0, 8);
    assertFalse(hints.getText().toString(), hints.getText().toString().contains(told));
    SystemClockNatives.pass(600_000);
    phone.until("the clock's change is told", () -> {
      phone.pass(500);
      return hints.getText().toString().contains(told);
    });
  }

  @Test public void aSessionThatEndsByItselfLeavesTheScreenWithItsReason() throws Exception {
    shown();
    phone.running(RecordingService.class).ended(new SessionEnd(EndState.DISK_FULL, "0"));
    phone.until("the screen ends", () -> {
      phone.pass(300);
      return screen.activity.isFinishing();
    });
    assertEquals(null, link.recording());
    assertFalse(phone.toasts().isEmpty());
  }
}
