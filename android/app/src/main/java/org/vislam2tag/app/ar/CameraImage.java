package org.vislam2tag.app.ar;

import android.opengl.GLES11Ext;
import android.opengl.GLES20;
import com.google.ar.core.Coordinates2d;
import com.google.ar.core.Frame;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.FloatBuffer;

/** Draws the camera's image over the whole surface. All calls are made on the surface's GL thread. */
final class CameraImage {
  private static final String VERTEX = "attribute vec2 corner; attribute vec2 texel; varying vec2 at;"
      + " void main() { gl_Position = vec4(corner, 0.0, 1.0); at = texel; }";
  private static final String FRAGMENT = "#extension GL_OES_EGL_image_external : require\n"
      + "precision mediump float; varying vec2 at; uniform samplerExternalOES image;"
      + " void main() { gl_FragColor = texture2D(image, at); }";
  private static final float[] CORNERS = {-1, -1, 1, -1, -1, 1, 1, 1};

  private final FloatBuffer corners = buffer();
  private final FloatBuffer texels = buffer();
  private final int texture;
  private final int program;
  private boolean placed;

  CameraImage() {
    int[] names = new int[1];
    GLES20.glGenTextures(1, names, 0);
    texture = names[0];
    GLES20.glBindTexture(GLES11Ext.GL_TEXTURE_EXTERNAL_OES, texture);
    GLES20.glTexParameteri(GLES11Ext.GL_TEXTURE_EXTERNAL_OES, GLES20.GL_TEXTURE_MIN_FILTER, GLES20.GL_LINEAR);
    GLES20.glTexParameteri(GLES11Ext.GL_TEXTURE_EXTERNAL_OES, GLES20.GL_TEXTURE_MAG_FILTER, GLES20.GL_LINEAR);
    program = GLES20.glCreateProgram();
    attach(GLES20.GL_VERTEX_SHADER, VERTEX);
    attach(GLES20.GL_FRAGMENT_SHADER, FRAGMENT);
    GLES20.glLinkProgram(program);
    corners.put(CORNERS).rewind();
  }

  /** Where ARCore puts the camera's image. */
  int texture() {
    return texture;
  }

  /** Draws the frame's image. */
  void draw(Frame frame) {
    if (frame.getTimestamp() == 0) {
      return; // the texture holds nothing yet
    }
    if (!placed || frame.hasDisplayGeometryChanged()) {
      frame.transformCoordinates2d(Coordinates2d.OPENGL_NORMALIZED_DEVICE_COORDINATES, corners,
          Coordinates2d.TEXTURE_NORMALIZED, texels);
      placed = true;
    }
    GLES20.glDisable(GLES20.GL_DEPTH_TEST);
    GLES20.glUseProgram(program);
    GLES20.glBindTexture(GLES11Ext.GL_TEXTURE_EXTERNAL_OES, texture);
    point("corner", corners);
    point("texel", texels);
    GLES20.glDrawArrays(GLES20.GL_TRIANGLE_STRIP, 0, 4);
  }

  private void point(String attribute, FloatBuffer values) {
    int at = GLES20.glGetAttribLocation(program, attribute);
    values.rewind();
    GLES20.glVertexAttribPointer(at, 2, GLES20.GL_FLOAT, false, 0, values);
    GLES20.glEnableVertexAttribArray(at);
  }

  private void attach(int type, String source) {
    int shader = GLES20.glCreateShader(type);
    GLES20.glShaderSource(shader, source);
    GLES20.glCompileShader(shader);
    GLES20.glAttachShader(program, shader);
  }

  private static FloatBuffer buffer() {
    return ByteBuffer.allocateDirect(CORNERS.length * 4).order(ByteOrder.nativeOrder()).asFloatBuffer();
  }
}
