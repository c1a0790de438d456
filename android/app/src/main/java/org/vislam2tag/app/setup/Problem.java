package org.vislam2tag.app.setup;

import android.content.Intent;
import android.net.Uri;
import android.provider.Settings;
import org.vislam2tag.app.R;

/** What stands in the way of a good recording; each has a sentence, and some a button that mends it. */
public enum Problem {
  NO_ARCORE(R.string.problem_no_arcore, "no_arcore", Fix.NONE),
  ARCORE_NEEDS_INSTALL(R.string.problem_arcore_install, "no_arcore", Fix.INSTALL_ARCORE),
  NO_CAMERA_PERMISSION(R.string.problem_no_camera, "no_camera_permission", Fix.ASK_PERMISSIONS),
  NO_LOCATION_PERMISSION(R.string.problem_no_location, "no_location_permission", Fix.ASK_PERMISSIONS),
  LOCATION_OFF(R.string.problem_location_off, null, Fix.LOCATION_SETTINGS),
  WIFI_OFF(R.string.problem_wifi_off, null, Fix.WIFI_SETTINGS),
  SCANS_THROTTLED(R.string.problem_throttled, null, Fix.DEVELOPER_SETTINGS),
  NO_BLUETOOTH_PERMISSION(R.string.problem_no_bluetooth_permission, null, Fix.ASK_PERMISSIONS),
  BLUETOOTH_OFF(R.string.problem_bluetooth_off, null, Fix.BLUETOOTH_SETTINGS),
  SENSORS_MISSING(R.string.problem_sensors_missing, null, Fix.NONE),
  NO_LANDMARKS(R.string.problem_no_landmarks, null, Fix.PICK_LANDMARKS),
  LANDMARKS_REFUSED(R.string.problem_landmarks_refused, null, Fix.NONE),
  STORAGE_LOW(R.string.problem_storage_low, null, Fix.NONE);

  /** What its button does. */
  public enum Fix {
    NONE(null), INSTALL_ARCORE(null), ASK_PERMISSIONS(null), PICK_LANDMARKS(null),
    LOCATION_SETTINGS(Settings.ACTION_LOCATION_SOURCE_SETTINGS), WIFI_SETTINGS(Settings.ACTION_WIFI_SETTINGS),
    BLUETOOTH_SETTINGS(Settings.ACTION_BLUETOOTH_SETTINGS), DEVELOPER_SETTINGS(Settings.ACTION_APPLICATION_DEVELOPMENT_SETTINGS),
    ABOUT_PHONE(Settings.ACTION_DEVICE_INFO_SETTINGS), BATTERY_SETTINGS(Settings.ACTION_IGNORE_BATTERY_OPTIMIZATION_SETTINGS),
    SAVER_SETTINGS(Settings.ACTION_BATTERY_SAVER_SETTINGS), APP_SETTINGS(Settings.ACTION_APPLICATION_DETAILS_SETTINGS);

    private final String page;

    Fix(String page) {
      this.page = page;
    }

    /** The page of the phone's settings that it leads to; only of those that lead to one. */
    Intent settings(String app) {
      return this == APP_SETTINGS ? new Intent(page, Uri.fromParts("package", app, null)) : new Intent(page);
    }
  }

  /** The sentence on the screen; {@code %s} stands for names, where it has them. */
  public final int sentence;
  /** The event that says so in the session; null where what feeds the recorder says it itself. */
  public final String event;
  public final Fix fix;

  Problem(int sentence, String event, Fix fix) {
    this.sentence = sentence;
    this.event = event;
    this.fix = fix;
  }

  /** Can the walk not be placed in the building with it, so that a collector should mean it? */
  boolean isAskedAbout() {
    return this == NO_ARCORE || this == ARCORE_NEEDS_INSTALL || this == NO_CAMERA_PERMISSION || this == NO_LANDMARKS;
  }
}
