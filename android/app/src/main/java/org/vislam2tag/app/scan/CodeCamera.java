package org.vislam2tag.app.scan;

import android.graphics.ImageFormat;
import android.hardware.camera2.CameraAccessException;
import android.hardware.camera2.CameraCaptureSession;
import android.hardware.camera2.CameraCharacteristics;
import android.hardware.camera2.CameraDevice;
import android.hardware.camera2.CameraManager;
import android.hardware.camera2.CaptureRequest;
import android.hardware.camera2.params.StreamConfigurationMap;
import android.media.Image;
import android.media.ImageReader;
import android.os.Handler;
import android.util.Size;
import android.view.Surface;
import android.view.SurfaceHolder;
import java.nio.ByteBuffer;
import java.util.Arrays;

/** The camera on the phone's back, whose pictures are shown and searched for a code. Lives on the handler's thread. */
final class CodeCamera extends CameraDevice.StateCallback implements ImageReader.OnImageAvailableListener {
  /** Is told, on the handler's thread. */
  interface Host {
    /** A code with this text is in view. */
    void found(String text);

    /** The camera cannot be had, for this reason. */
    void failed(String reason);
  }

  /** Enough for a code at arm's length; more only takes longer. */
  static final int MOST_PIXELS = 1280 * 960;

  private final CameraManager cameras;
  private final Handler handler;
  private final Host host;
  private final String id;
  /** Of the pictures, as the camera's sensor lies: wider than high. */
  final Size size;
  private Surface screen;
  private ImageReader pictures;
  private CameraDevice device;
  private boolean closed;

  /** Throws a CameraAccessException where the phone has no such camera, or none that can be asked. */
  CodeCamera(CameraManager cameras, Handler handler, Host host) throws CameraAccessException {
    this.cameras = cameras;
    this.handler = handler;
    this.host = host;
    id = back(cameras);
    StreamConfigurationMap map = cameras.getCameraCharacteristics(id).get(CameraCharacteristics.SCALER_STREAM_CONFIGURATION_MAP);
    size = largest(map.getOutputSizes(SurfaceHolder.class));
  }

  /** Begins to show and to search, once. The collector allowed the camera. */
  void open(Surface on) throws CameraAccessException {
    if (pictures != null) {
      return;
    }
    screen = on;
    pictures = ImageReader.newInstance(size.getWidth(), size.getHeight(), ImageFormat.YUV_420_888, 2);
    pictures.setOnImageAvailableListener(this, handler);
    cameras.openCamera(id, this, handler);
  }

  /** Gives the camera back; nobody is told anything any more. */
  void close() {
    closed = true;
    if (device != null) {
      device.close();
    }
    if (pictures != null) {
      pictures.close();
    }
  }

  @Override public void onOpened(CameraDevice opened) {
    if (closed) {
      opened.close();
      return;
    }
    device = opened;
    try {
      opened.createCaptureSession(Arrays.asList(screen, pictures.getSurface()), new Capture(), handler);
    } catch (CameraAccessException | IllegalArgumentException | IllegalStateException e) { // the screen went meanwhile
      fail(e);
    }
  }

  @Override public void onDisconnected(CameraDevice gone) {
    gone.close();
  }

  @Override public void onError(CameraDevice broken, int error) {
    broken.close();
    host.failed("error " + error);
  }

  @Override public void onImageAvailable(ImageReader reader) {
    if (closed) {
      return;
    }
    try (Image image = reader.acquireLatestImage()) {
      String text = image == null ? null : read(image);
      if (text != null) {
        closed = true;
        host.found(text);
      }
    }
  }

  /** The code in a picture, whose first plane is its light. */
  static String read(Image image) {
    Image.Plane light = image.getPlanes()[0];
    ByteBuffer buffer = light.getBuffer();
    byte[] grey = new byte[light.getRowStride() * image.getHeight()];
    buffer.get(grey, 0, Math.min(grey.length, buffer.remaining())); // the last row may end with its last pixel
    return CodeReader.read(grey, light.getRowStride(), image.getWidth(), image.getHeight());
  }

  /** The largest of at most {@link #MOST_PIXELS}; the smallest where all have more. */
  static Size largest(Size[] sizes) {
    Size best = sizes[0];
    for (Size size : sizes) {
      boolean fits = pixels(size) <= MOST_PIXELS;
      boolean better = pixels(best) > MOST_PIXELS ? pixels(size) < pixels(best) : fits && pixels(size) > pixels(best);
      best = better ? size : best;
    }
    return best;
  }

  private static int pixels(Size size) {
    return size.getWidth() * size.getHeight();
  }

  private static String back(CameraManager cameras) throws CameraAccessException {
    for (String id : cameras.getCameraIdList()) {
      Integer facing = cameras.getCameraCharacteristics(id).get(CameraCharacteristics.LENS_FACING);
      if (facing != null && facing == CameraCharacteristics.LENS_FACING_BACK) {
        return id;
      }
    }
    throw new CameraAccessException(CameraAccessException.CAMERA_ERROR, "no camera on the back");
  }

  private void fail(Exception e) {
    if (!closed) {
      host.failed(String.valueOf(e.getMessage()));
    }
  }

  private final class Capture extends CameraCaptureSession.StateCallback {
    @Override public void onConfigured(CameraCaptureSession session) {
      if (closed) {
        return;
      }
      try {
        CaptureRequest.Builder request = device.createCaptureRequest(CameraDevice.TEMPLATE_PREVIEW);
        request.addTarget(screen);
        request.addTarget(pictures.getSurface());
        request.set(CaptureRequest.CONTROL_AF_MODE, CaptureRequest.CONTROL_AF_MODE_CONTINUOUS_PICTURE);
        session.setRepeatingRequest(request.build(), null, handler);
      } catch (CameraAccessException | IllegalArgumentException | IllegalStateException e) { // it was taken meanwhile
        fail(e);
      }
    }

    @Override public void onConfigureFailed(CameraCaptureSession session) {
      host.failed("not configured");
    }
  }
}
