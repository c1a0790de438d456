package org.vislam2tag.app.ar;

import android.content.Context;
import android.opengl.GLES20;
import android.opengl.GLSurfaceView;
import android.os.SystemClock;
import android.view.WindowManager;
import com.google.ar.core.exceptions.CameraNotAvailableException;
import com.google.ar.core.exceptions.FatalException;
import java.util.concurrent.ExecutionException;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;
import java.util.concurrent.Future;
import javax.microedition.khronos.egl.EGLConfig;
import javax.microedition.khronos.opengles.GL10;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.session.Recorder;

/**
 * Shows the camera's image and drives the tracker: each drawn frame is one update of ARCore, recorded where a recording
 * runs. When the view pauses the camera goes to others; when it resumes a new tracking session begins, a part of its own.
 */
public final class CameraView extends GLSurfaceView implements GLSurfaceView.Renderer {
  /** Where frames go, and who is told that the camera came or went. Called on the GL thread. */
  public interface Host {
    /** The recording that runs, or null. */
    Recorder recorder();

    /** The images to look for. */
    LandmarkImages landmarks();

    /** The camera gives frames again. */
    void cameraAvailable();

    /** The camera gives none, for a reason in the words of the log. */
    void cameraUnavailable(String reason);
  }

  private static final long RETRY_MS = 1000;

  private Host host;
  private Clocks clocks;
  private CameraImage image;
  private ArSession session;
  /** Makes and ends sessions, which may take seconds, one after the other. */
  private final ExecutorService work = Executors.newSingleThreadExecutor();
  private volatile Future<ArSession> opening;
  private boolean wanted;
  private long notBeforeMs;
  private int width;
  private int height;

  /** As Android's layouts make it. */
  public CameraView(Context context) {
    super(context);
  }

  /** Says where frames go; once, before the view is shown. */
  public void attach(Host to, Clocks with) {
    host = to;
    clocks = with;
    setPreserveEGLContextOnPause(true);
    setEGLContextClientVersion(2);
    setRenderer(this);
    setRenderMode(RENDERMODE_CONTINUOUSLY);
  }

  @Override public void onResume() {
    super.onResume();
    queueEvent(() -> wanted = true);
  }

  @Override public void onPause() {
    queueEvent(() -> {
      wanted = false;
      close("screen");
    });
    super.onPause();
  }

  /** Is the tracker being made ready? From the main thread. */
  public boolean isPreparing() {
    return opening != null;
  }

  /** Never shown again; after the last {@link #onPause}. */
  public void release() {
    Future<ArSession> unused = opening;
    work.execute(() -> closeUnused(unused));
    work.shutdown();
  }

  @Override public void onSurfaceCreated(GL10 gl, EGLConfig config) {
    close("surface");
    image = new CameraImage();
    wanted = true;
  }

  @Override public void onSurfaceChanged(GL10 gl, int newWidth, int newHeight) {
    width = newWidth;
    height = newHeight;
    GLES20.glViewport(0, 0, width, height);
    if (session != null) {
      session.resize(rotation(), width, height);
    }
  }

  @Override public void onDrawFrame(GL10 gl) {
    GLES20.glClear(GLES20.GL_COLOR_BUFFER_BIT);
    if (session == null && wanted && SystemClock.elapsedRealtime() >= notBeforeMs) {
      open();
    }
    if (session == null) {
      return;
    }
    try {
      image.draw(session.update(host.recorder(), clocks));
    } catch (CameraNotAvailableException e) {
      close("camera in use");
    } catch (FatalException e) {
      close(e.getClass().getSimpleName()); // the tracker is at its end; Wi-Fi and sensors are not
    }
  }

  private void open() {
    if (opening == null) {
      opening = work.submit(() -> ArSession.open(getContext(), host.landmarks()));
    } else if (opening.isDone()) {
      resume(opening);
      opening = null;
    }
  }

  private void resume(Future<ArSession> made) {
    try {
      resume(made.get());
    } catch (ExecutionException e) {
      failed(e.getCause());
    } catch (InterruptedException e) {
      Thread.currentThread().interrupt(); // it was done: nothing is waited for
    }
  }

  private void resume(ArSession opened) {
    try {
      opened.resume(image.texture(), rotation(), width, height);
      session = opened;
      host.cameraAvailable();
    } catch (CameraNotAvailableException | FatalException | SecurityException e) {
      work.execute(opened::close);
      failed(e);
    }
  }

  private void failed(Throwable cause) {
    notBeforeMs = SystemClock.elapsedRealtime() + RETRY_MS;
    host.cameraUnavailable(cause.getClass().getSimpleName());
  }

  private void close(String reason) {
    if (session != null) {
      ArSession over = session;
      session = null;
      over.pause();
      work.execute(over::close);
      notBeforeMs = SystemClock.elapsedRealtime() + RETRY_MS;
      host.cameraUnavailable(reason);
    }
  }

  private static void closeUnused(Future<ArSession> made) {
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

  @SuppressWarnings("deprecation") // its successor is newer than API 29
  private int rotation() {
    WindowManager windows = (WindowManager) getContext().getSystemService(Context.WINDOW_SERVICE);
    return windows.getDefaultDisplay().getRotation();
  }
}
