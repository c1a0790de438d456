package org.vislam2tag.app.recording;

import org.vislam2tag.core.session.Recorder;

/** Saves the session when the app dies of an exception, before Android ends it. */
final class CrashGuard {
  private static volatile Recorder recorder;
  private static boolean guards;
  private static Thread.UncaughtExceptionHandler before;

  private CrashGuard() {}

  static synchronized void guard(Recorder running) {
    if (!guards) {
      guards = true;
      before = Thread.getDefaultUncaughtExceptionHandler();
      Thread.setDefaultUncaughtExceptionHandler(CrashGuard::died);
    }
    recorder = running;
  }

  static void release() {
    recorder = null;
  }

  private static void died(Thread thread, Throwable cause) {
    Recorder running = recorder;
    if (running != null) {
      running.crashed(cause);
    }
    if (before != null) {
      before.uncaughtException(thread, cause);
    }
  }
}
