package org.vislam2tag.app.scan;

import android.Manifest;
import android.app.Activity;
import android.content.Intent;
import android.content.pm.PackageManager;
import android.hardware.camera2.CameraAccessException;
import android.hardware.camera2.CameraManager;
import android.os.Bundle;
import android.os.Handler;
import android.os.HandlerThread;
import android.view.SurfaceHolder;
import android.view.SurfaceView;
import android.widget.Toast;
import org.vislam2tag.app.R;

/** Looks for the code that {@code vislam2tag receive} shows; answers with its text as {@link #TEXT}. */
public final class ScanActivity extends Activity implements SurfaceHolder.Callback, CodeCamera.Host {
  /** Of the answer's extras. */
  public static final String TEXT = "text";
  private static final int ASK = 1;

  private final HandlerThread thread = new HandlerThread("scan");
  private Handler handler;
  private SurfaceView screen;
  private CodeCamera camera;

  @Override protected void onCreate(Bundle saved) {
    super.onCreate(saved);
    setContentView(R.layout.scan);
    thread.start();
    handler = new Handler(thread.getLooper());
    screen = findViewById(R.id.screen);
    screen.getHolder().addCallback(this);
    if (!allowed()) {
      requestPermissions(new String[] {Manifest.permission.CAMERA}, ASK);
    }
  }

  @Override protected void onDestroy() {
    thread.quitSafely();
    super.onDestroy();
  }

  @Override public void onRequestPermissionsResult(int request, String[] permissions, int[] given) {
    if (allowed()) {
      recreate(); // its surface came while the question was open
    } else {
      failed(getString(R.string.scan_not_allowed));
    }
  }

  @Override public void surfaceCreated(SurfaceHolder holder) {
    if (!allowed()) {
      return;
    }
    try {
      camera = new CodeCamera((CameraManager) getSystemService(CAMERA_SERVICE), handler, this);
      // Upright, the picture is as high as the sensor is wide.
      screen.getLayoutParams().height = screen.getWidth() * camera.size.getWidth() / camera.size.getHeight();
      holder.setFixedSize(camera.size.getWidth(), camera.size.getHeight());
    } catch (CameraAccessException e) {
      failed(String.valueOf(e.getMessage()));
    }
  }

  /** The camera writes into a surface of its own size only. */
  @Override public void surfaceChanged(SurfaceHolder holder, int format, int width, int height) {
    if (camera == null || width != camera.size.getWidth() || height != camera.size.getHeight()) {
      return;
    }
    try {
      camera.open(holder.getSurface());
    } catch (CameraAccessException | SecurityException e) {
      failed(String.valueOf(e.getMessage()));
    }
  }

  @Override public void surfaceDestroyed(SurfaceHolder holder) {
    if (camera != null) {
      handler.post(camera::close);
      camera = null;
    }
  }

  @Override public void found(String text) {
    runOnUiThread(() -> {
      setResult(RESULT_OK, new Intent().putExtra(TEXT, text));
      finish();
    });
  }

  @Override public void failed(String reason) {
    runOnUiThread(() -> {
      Toast.makeText(this, getString(R.string.scan_failed, reason), Toast.LENGTH_LONG).show();
      finish();
    });
  }

  private boolean allowed() {
    return checkSelfPermission(Manifest.permission.CAMERA) == PackageManager.PERMISSION_GRANTED;
  }
}
