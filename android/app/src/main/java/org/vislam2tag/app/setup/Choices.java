package org.vislam2tag.app.setup;

import android.content.Context;
import android.content.SharedPreferences;
import android.os.Build;
import org.vislam2tag.core.session.DeviceName;
import org.vislam2tag.core.session.SensorOn;

/** What the collector chose last time. */
final class Choices {
  /** Rates that are offered, Hz; the last one is as fast as the phone can. */
  static final double[] RATES_HZ = {100, 200, 50, SensorOn.FASTEST};
  private static final float USUAL_WIDTH_M = 0.18f;

  private final SharedPreferences kept;

  Choices(Context context) {
    kept = context.getSharedPreferences("choices", Context.MODE_PRIVATE);
  }

  String site() {
    return kept.getString("site", "");
  }

  String floor() {
    return kept.getString("floor", "0");
  }

  String device() {
    return kept.getString("device", DeviceName.proposedFrom(Build.MODEL));
  }

  int rate() {
    return kept.getInt("rate", 0);
  }

  /** The picked folder's address; null where none was. */
  String landmarks() {
    return kept.getString("landmarks", null);
  }

  /** Width of the prints of a folder without manifest, m. */
  float widthM() {
    return kept.getFloat("width_m", USUAL_WIDTH_M);
  }

  void keep(String site, String floor, String device, int rate, float widthM) {
    kept.edit().putString("site", site).putString("floor", floor).putString("device", device).putInt("rate", rate)
        .putFloat("width_m", widthM).apply();
  }

  /** Does the collector walk without camera, tapping the plan? */
  boolean withoutCamera() {
    return kept.getBoolean("without_camera", false);
  }

  void keepWithoutCamera(boolean without) {
    kept.edit().putBoolean("without_camera", without).apply();
  }

  void keepLandmarks(String folder) {
    kept.edit().putString("landmarks", folder).apply();
  }
}
