package org.vislam2tag.app.scan;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.fail;
import static org.mockito.ArgumentMatchers.any;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.verify;
import static org.mockito.Mockito.when;

import android.hardware.camera2.CameraAccessException;
import android.hardware.camera2.CameraCharacteristics;
import android.hardware.camera2.CameraDevice;
import android.hardware.camera2.CameraManager;
import android.hardware.camera2.params.StreamConfigurationMap;
import android.media.Image;
import android.media.ImageReader;
import android.util.Size;
import android.view.SurfaceHolder;
import java.nio.ByteBuffer;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;
import org.junit.Test;

public class CodeCameraTest {
  private final CameraManager cameras = mock(CameraManager.class);
  private final List<String> told = new ArrayList<>();
  private final CodeCamera.Host host = new CodeCamera.Host() {
    @Override public void found(String text) {
      told.add(text);
    }

    @Override public void failed(String reason) {
      told.add("failed: " + reason);
    }
  };

  private CodeCamera camera() throws CameraAccessException {
    when(cameras.getCameraIdList()).thenReturn(new String[] {"0"});
    CameraCharacteristics what = mock(CameraCharacteristics.class);
    StreamConfigurationMap map = mock(StreamConfigurationMap.class);
    Size[] sizes = {size(640, 480)};
    when(map.getOutputSizes(SurfaceHolder.class)).thenReturn(sizes);
    when(what.get(any())).thenReturn(CameraCharacteristics.LENS_FACING_BACK, map);
    when(cameras.getCameraCharacteristics("0")).thenReturn(what);
    return new CodeCamera(cameras, null, host);
  }

  private static Size size(int width, int height) {
    Size size = mock(Size.class);
    when(size.getWidth()).thenReturn(width);
    when(size.getHeight()).thenReturn(height);
    return size;
  }

  /** The last row ends with its last pixel, as cameras have it. */
  private static ImageReader seeing(CodePicture picture) {
    int bytes = CodePicture.STRIDE * (CodePicture.HEIGHT - 1) + CodePicture.WIDTH;
    Image.Plane light = mock(Image.Plane.class);
    when(light.getRowStride()).thenReturn(CodePicture.STRIDE);
    when(light.getBuffer()).thenAnswer(call -> ByteBuffer.wrap(picture.grey(1), 0, bytes).slice());
    Image image = mock(Image.class);
    when(image.getPlanes()).thenReturn(new Image.Plane[] {light});
    when(image.getWidth()).thenReturn(CodePicture.WIDTH);
    when(image.getHeight()).thenReturn(CodePicture.HEIGHT);
    ImageReader reader = mock(ImageReader.class);
    when(reader.acquireLatestImage()).thenReturn(image);
    return reader;
  }

  @Test public void aCodeInViewIsToldOnce() throws Exception {
    CodeCamera camera = camera();
    ImageReader reader = seeing(new CodePicture(90, 7, false));
    camera.onImageAvailable(reader);
    camera.onImageAvailable(reader);
    assertEquals(Collections.singletonList(CodePicture.TEXT), told);
  }

  @Test public void aPictureThatIsGoneAlreadyIsNoFault() throws Exception {
    camera().onImageAvailable(mock(ImageReader.class));
    assertEquals(Collections.emptyList(), told);
  }

  @Test public void aCameraThatOpensAfterTheScreenWentIsGivenBack() throws Exception {
    CodeCamera camera = camera();
    camera.close();
    CameraDevice device = mock(CameraDevice.class);
    camera.onOpened(device);
    verify(device).close();
  }

  @Test public void aCameraThatBreaksIsTold() throws Exception {
    camera().onError(mock(CameraDevice.class), CameraDevice.StateCallback.ERROR_CAMERA_IN_USE);
    assertEquals(Collections.singletonList("failed: error " + CameraDevice.StateCallback.ERROR_CAMERA_IN_USE), told);
  }

  @Test public void aPhoneWithoutCameraOnItsBackIsTold() throws Exception {
    when(cameras.getCameraIdList()).thenReturn(new String[0]);
    try {
      new CodeCamera(cameras, null, host);
      fail("a camera was found");
    } catch (CameraAccessException e) {
      assertEquals(Collections.emptyList(), told);
    }
  }

  @Test public void picturesAreLargeEnoughAndNoLarger() {
    Size huge = size(4000, 3000);
    Size usual = size(1280, 720);
    Size small = size(640, 480);
    assertEquals(usual, CodeCamera.largest(new Size[] {huge, small, usual}));
    assertEquals(small, CodeCamera.largest(new Size[] {small, huge}));
    assertEquals(huge, CodeCamera.largest(new Size[] {huge}));
  }
}
