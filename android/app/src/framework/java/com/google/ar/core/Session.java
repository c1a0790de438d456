package com.google.ar.core;

import android.content.Context;
import com.google.ar.core.exceptions.CameraNotAvailableException;
import com.google.ar.core.exceptions.UnavailableApkTooOldException;
import com.google.ar.core.exceptions.UnavailableArcoreNotInstalledException;
import com.google.ar.core.exceptions.UnavailableDeviceNotCompatibleException;
import com.google.ar.core.exceptions.UnavailableSdkTooOldException;
import java.util.Collection;
import java.util.Collections;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
import java.util.concurrent.atomic.AtomicInteger;
import java.util.function.Function;

/** Stands for ARCore's class of this name: it remembers its calls, and throws at them what a test says. */
public class Session {
  /** Names of calls of all sessions, {@code Session} for making one. */
  public static final List<String> CALLS = new CopyOnWriteArrayList<>();
  /** How many have the camera. */
  public static final AtomicInteger RESUMED = new AtomicInteger();
  /** What a call of this name throws; null for nothing. */
  public static volatile Function<String, Throwable> throwing;
  /** What {@link #update} answers. */
  public static volatile Frame frame;

  private boolean resumed;

  public Session(Context context) throws UnavailableArcoreNotInstalledException, UnavailableApkTooOldException,
      UnavailableSdkTooOldException, UnavailableDeviceNotCompatibleException {
    called("Session");
  }

  /** What {@link #createAnchor} answers. */
  public static volatile Anchor anchor;

  /** As on a phone where nothing goes wrong. */
  public static void reset(Frame newest, Anchor made) {
    CALLS.clear();
    RESUMED.set(0);
    throwing = call -> null;
    frame = newest;
    anchor = made;
  }

  @SuppressWarnings("unchecked")
  private static <T extends Throwable> void called(String name) throws T {
    CALLS.add(name);
    Throwable thrown = throwing.apply(name);
    if (thrown != null) {
      throw (T) thrown;
    }
  }

  public void configure(Config config) {
    called("configure");
  }

  public void setCameraTextureName(int texture) {
    called("setCameraTextureName");
  }

  public void setDisplayGeometry(int rotation, int width, int height) {
    called("setDisplayGeometry");
  }

  public void resume() throws CameraNotAvailableException {
    called("resume");
    resumed = true;
    RESUMED.incrementAndGet();
  }

  public Frame update() throws CameraNotAvailableException {
    called("update");
    return frame;
  }

  public void pause() {
    end();
    called("pause");
  }

  public void close() {
    end();
    called("close");
  }

  private void end() {
    if (resumed) {
      resumed = false;
      RESUMED.decrementAndGet();
    }
  }

  public Anchor createAnchor(Pose pose) {
    called("createAnchor");
    return anchor;
  }

  public <T extends Trackable> Collection<T> getAllTrackables(Class<T> type) {
    called("getAllTrackables");
    return Collections.emptyList();
  }
}
