package org.vislam2tag.app.ar;

import android.content.Context;
import android.opengl.GLES20;
import android.opengl.GLSurfaceView;
import android.os.SystemClock;
import android.view.WindowManager;
import com.google.ar.core.Frame;
import com.google.ar.core.exceptions.CameraNotAvailableException;
import java.io.File;
import javax.microedition.khronos.egl.EGLConfig;
import javax.microedition.khronos.opengles.GL10;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.session.Recorder;

/**
 * Shows the camera's image and drives the tracker: each drawn frame is one update of ARCore, recorded where a recording
 * runs. When the view pauses the camera goes to others; when it resumes a new tracking session begins, a part of its own.
 */
public final class CameraView extends GLSurfaceView implements GLSurfaceView.Renderer, CameraLoop.Screen {
  /** Where frames go, and who is told that the camera came or went. Called on the GL thread. */
  public interface Host {
    /** The recording that runs, or null. */
    Recorder recorder();

    /** The images to look for. */
    LandmarkImages landmarks();

    /** Where ARCore is to record what it sees, for developers; null: nowhere. */
    File dataset();

    /** The camera gives frames again. */
    void cameraAvailable();

    /** The camera gives none, for a reason in the words of the log. */
    void cameraUnavailable(String reason);
  }

  private CameraLoop loop;
  private CameraImage image;
  private int width;
  private int height;

  /** As Android's layouts make it. */
  public CameraView(Context context) {
    super(context);
  }

  /** Says where frames go; once, before the view is shown. */
  public void attach(Host to, Clocks with) {
    loop = new CameraLoop(to, with, () -> ArSession.open(getContext(), to.landmarks(), to.dataset()), this, SystemClock::elapsedRealtime);
    setPreserveEGLContextOnPause(true);
    setEGLContextClientVersion(2);
    setRenderer(this);
    setRenderMode(RENDERMODE_CONTINUOUSLY);
  }

  @Override public void onResume() {
    super.onResume();
    queueEvent(loop::want);
  }

  @Override public void onPause() {
    queueEvent(loop::leave);
    super.onPause();
  }

  /** Is the tracker being made ready? From the main thread. */
  public boolean isPreparing() {
    return loop.isPreparing();
  }

  /** Never shown again; after the last {@link #onPause}. */
  public void release() {
    loop.release();
  }

  @Override public void onSurfaceCreated(GL10 gl, EGLConfig config) {
    loop.close("surface");
    image = new CameraImage();
    loop.want();
  }

  @Override public void onSurfaceChanged(GL10 gl, int newWidth, int newHeight) {
    width = newWidth;
    height = newHeight;
    GLES20.glViewport(0, 0, width, height);
    if (loop.tracker() != null) {
      loop.tracker().resize(rotation(), width, height);
    }
  }

  @Override public void onDrawFrame(GL10 gl) {
    GLES20.glClear(GLES20.GL_COLOR_BUFFER_BIT);
    loop.frame();
  }

  @Override public void begin(Tracker tracker) throws CameraNotAvailableException {
    tracker.resume(image.texture(), rotation(), width, height);
  }

  @Override public void draw(Frame frame) {
    image.draw(frame);
  }

  @SuppressWarnings("deprecation") // its successor is newer than API 29
  private int rotation() {
    WindowManager windows = (WindowManager) getContext().getSystemService(Context.WINDOW_SERVICE);
    return windows.getDefaultDisplay().getRotation();
  }
}
