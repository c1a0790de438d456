package org.vislam2tag.app.setup;

import android.Manifest;
import android.content.Context;
import android.content.pm.PackageManager;
import java.util.ArrayList;
import java.util.List;

/** The permissions that a recording needs on this Android. */
final class Permissions {
  static final String BLUETOOTH_SCAN = "android.permission.BLUETOOTH_SCAN"; // API 31
  static final String POST_NOTIFICATIONS = "android.permission.POST_NOTIFICATIONS"; // API 33
  static final String NEARBY_WIFI = "android.permission.NEARBY_WIFI_DEVICES"; // API 33
  private static final int ANDROID_12 = 31;
  private static final int ANDROID_13 = 33;

  private Permissions() {}

  /** All that are asked for. */
  static List<String> needed(int api) {
    List<String> needed = new ArrayList<>();
    needed.add(Manifest.permission.CAMERA);
    needed.add(Manifest.permission.ACCESS_FINE_LOCATION);
    needed.add(Manifest.permission.ACCESS_COARSE_LOCATION); // from Android 12 on the fine one is given only beside it
    if (api >= ANDROID_12) {
      needed.add(BLUETOOTH_SCAN);
    }
    if (api >= ANDROID_13) {
      needed.add(NEARBY_WIFI);
      needed.add(POST_NOTIFICATIONS);
    }
    return needed;
  }

  /** May the app hear Bluetooth? Before Android 12 the location's permission says so. */
  static boolean bluetoothAllowed(Context context, int api) {
    return api < ANDROID_12 || isGiven(context, BLUETOOTH_SCAN);
  }

  /** Was it refused in a way that Android does not show its question again? The notice's permission is
   * nobody's worry, and that of ranges comes with Bluetooth's. */
  static boolean isAskedNoMore(String permission, int given, boolean mayAskAgain) {
    return given != PackageManager.PERMISSION_GRANTED && !mayAskAgain && !permission.equals(POST_NOTIFICATIONS)
        && !permission.equals(NEARBY_WIFI) && !permission.equals(Manifest.permission.ACCESS_COARSE_LOCATION);
  }

  static boolean isGiven(Context context, String permission) {
    return context.checkSelfPermission(permission) == PackageManager.PERMISSION_GRANTED;
  }
}
