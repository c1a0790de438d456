package com.google.ar.core;

import android.app.Activity;
import android.content.Context;
import com.google.ar.core.exceptions.UnavailableDeviceNotCompatibleException;
import com.google.ar.core.exceptions.UnavailableUserDeclinedInstallationException;

/** Stands for ARCore's class of this name: the one instance is a test's. */
public class ArCoreApk {
  /** What a test put there. */
  public static ArCoreApk instance;

  public enum Availability {
    UNKNOWN_ERROR, UNKNOWN_CHECKING, UNKNOWN_TIMED_OUT, UNSUPPORTED_DEVICE_NOT_CAPABLE, SUPPORTED_NOT_INSTALLED,
    SUPPORTED_APK_TOO_OLD, SUPPORTED_INSTALLED;

    public boolean isTransient() {
      return this == UNKNOWN_CHECKING;
    }
  }

  public enum InstallStatus { INSTALLED, INSTALL_REQUESTED }

  public static ArCoreApk getInstance() {
    return instance;
  }

  public Availability checkAvailability(Context context) {
    return Availability.SUPPORTED_INSTALLED;
  }

  public InstallStatus requestInstall(Activity screen, boolean byCollector)
      throws UnavailableDeviceNotCompatibleException, UnavailableUserDeclinedInstallationException {
    return InstallStatus.INSTALLED;
  }
}
