package com.google.android.gles_jni;

import java.util.concurrent.atomic.AtomicLong;
import javax.microedition.khronos.egl.EGL10;
import javax.microedition.khronos.egl.EGLConfig;
import javax.microedition.khronos.egl.EGLContext;
import javax.microedition.khronos.egl.EGLDisplay;
import javax.microedition.khronos.egl.EGLSurface;

/** A display with one configuration, whose surfaces nobody sees. A test may have it lose its context. */
public final class EGLImplNatives {
  /** Frames that were shown. */
  public static final AtomicLong SWAPS = new AtomicLong();
  private static final AtomicLong LAST = new AtomicLong(1);
  private static volatile boolean lost;

  private EGLImplNatives() {}

  /** The next frame finds the context lost, as after a phone's deep sleep. */
  public static void loseContext() {
    lost = true;
  }

  static long _eglGetDisplay(EGLImpl self, Object display) {
    return 1;
  }

  static boolean eglInitialize(EGLImpl self, EGLDisplay display, int[] version) {
    return true;
  }

  static boolean eglChooseConfig(EGLImpl self, EGLDisplay display, int[] wanted, EGLConfig[] configs, int size, int[] count) {
    count[0] = 1;
    if (configs != null) {
      configs[0] = new EGLConfigImpl(1);
    }
    return true;
  }

  static boolean eglGetConfigAttrib(EGLImpl self, EGLDisplay display, EGLConfig config, int attribute, int[] value) {
    boolean depth = attribute == EGL10.EGL_DEPTH_SIZE;
    boolean colour = attribute == EGL10.EGL_RED_SIZE || attribute == EGL10.EGL_GREEN_SIZE || attribute == EGL10.EGL_BLUE_SIZE;
    value[0] = depth ? 16 : colour ? 8 : 0;
    return true;
  }

  static long _eglCreateContext(EGLImpl self, EGLDisplay display, EGLConfig config, EGLContext shared, int[] attributes) {
    lost = false;
    return LAST.incrementAndGet();
  }

  static long _eglCreateWindowSurface(EGLImpl self, EGLDisplay display, EGLConfig config, Object window, int[] attributes) {
    return LAST.incrementAndGet();
  }

  static boolean eglMakeCurrent(EGLImpl self, EGLDisplay display, EGLSurface draw, EGLSurface read, EGLContext context) {
    return true;
  }

  static boolean eglSwapBuffers(EGLImpl self, EGLDisplay display, EGLSurface surface) {
    if (!lost) {
      SWAPS.incrementAndGet();
    }
    return !lost;
  }

  static int eglGetError(EGLImpl self) {
    return lost ? 0x300E : EGL10.EGL_SUCCESS; // EGL11.EGL_CONTEXT_LOST
  }

  static boolean eglDestroyContext(EGLImpl self, EGLDisplay display, EGLContext context) {
    return true;
  }

  static boolean eglDestroySurface(EGLImpl self, EGLDisplay display, EGLSurface surface) {
    return true;
  }

  static boolean eglTerminate(EGLImpl self, EGLDisplay display) {
    return true;
  }
}
