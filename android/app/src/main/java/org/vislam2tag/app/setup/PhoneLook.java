package org.vislam2tag.app.setup;

import android.bluetooth.BluetoothAdapter;
import android.bluetooth.BluetoothManager;
import android.content.Context;
import android.content.pm.PackageManager;
import android.hardware.SensorManager;
import android.location.LocationManager;
import android.net.wifi.WifiManager;
import android.os.Build;
import android.os.PowerManager;
import android.provider.Settings;
import com.google.ar.core.ArCoreApk;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import org.vislam2tag.app.ar.LandmarkImages;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.app.sensing.Surroundings;
import org.vislam2tag.core.record.SensorKind;

/** Looks at the phone before a start. */
final class PhoneLook {
  private static final int ANDROID_11 = 30;

  private final Context context;

  PhoneLook(Context context) {
    this.context = context;
  }

  /** What there is. */
  PhoneFacts facts(LandmarkImages landmarks) {
    PhoneFacts facts = new PhoneFacts();
    facts.arCore = arCore();
    facts.cameraAllowed = Permissions.isGiven(context, android.Manifest.permission.CAMERA);
    facts.locationAllowed = Permissions.isGiven(context, android.Manifest.permission.ACCESS_FINE_LOCATION);
    facts.bluetoothAllowed = Permissions.bluetoothAllowed(context, Build.VERSION.SDK_INT);
    facts.locationOn = Surroundings.isLocationOn((LocationManager) context.getSystemService(Context.LOCATION_SERVICE));
    WifiManager wifi = (WifiManager) context.getApplicationContext().getSystemService(Context.WIFI_SERVICE);
    facts.wifiOn = isWifiOn(wifi);
    facts.scansThrottled = areScansThrottled(wifi);
    facts.bluetoothOn = bluetoothOn();
    facts.missingSensors = missingSensors();
    facts.freeBytes = RecordingService.sessions(context).getUsableSpace();
    facts.landmarks = landmarks.count();
    facts.refusedLandmarks = Arrays.asList(landmarks.refusedIds());
    return facts;
  }

  /** What lets scans run. */
  ScanFacts scans() {
    ScanFacts facts = new ScanFacts();
    WifiManager wifi = (WifiManager) context.getApplicationContext().getSystemService(Context.WIFI_SERVICE);
    PowerManager power = (PowerManager) context.getSystemService(Context.POWER_SERVICE);
    facts.api = Build.VERSION.SDK_INT;
    facts.maker = Build.MANUFACTURER;
    facts.locationAllowed = Permissions.isGiven(context, android.Manifest.permission.ACCESS_FINE_LOCATION);
    facts.locationOn = Surroundings.isLocationOn((LocationManager) context.getSystemService(Context.LOCATION_SERVICE));
    facts.wifiOn = isWifiOn(wifi);
    facts.developerOptions = Settings.Global.getInt(context.getContentResolver(), Settings.Global.DEVELOPMENT_SETTINGS_ENABLED, 0) != 0;
    facts.scansThrottled = areScansThrottled(wifi);
    facts.unrestricted = power.isIgnoringBatteryOptimizations(context.getPackageName());
    facts.batterySaver = power.isPowerSaveMode();
    return facts;
  }

  private static boolean isWifiOn(WifiManager wifi) {
    return wifi != null && (wifi.isWifiEnabled() || wifi.isScanAlwaysAvailable());
  }

  private static boolean areScansThrottled(WifiManager wifi) {
    return wifi != null && Build.VERSION.SDK_INT >= ANDROID_11 && wifi.isScanThrottleEnabled();
  }

  private PhoneFacts.ArCore arCore() {
    ArCoreApk.Availability known = ArCoreApk.getInstance().checkAvailability(context);
    if (known.isTransient()) {
      return PhoneFacts.ArCore.BEING_LOOKED_UP;
    }
    switch (known) {
      case SUPPORTED_INSTALLED:
        return PhoneFacts.ArCore.READY;
      case UNSUPPORTED_DEVICE_NOT_CAPABLE:
        return PhoneFacts.ArCore.UNSUPPORTED;
      default: // too old, not installed, or not to be known: asking to install tells
        return PhoneFacts.ArCore.NEEDS_INSTALL;
    }
  }

  private boolean bluetoothOn() {
    BluetoothManager manager = (BluetoothManager) context.getSystemService(Context.BLUETOOTH_SERVICE);
    BluetoothAdapter adapter = manager == null ? null : manager.getAdapter();
    return adapter != null && adapter.isEnabled()
        || !context.getPackageManager().hasSystemFeature(PackageManager.FEATURE_BLUETOOTH_LE);
  }

  private List<String> missingSensors() {
    SensorManager sensors = (SensorManager) context.getSystemService(Context.SENSOR_SERVICE);
    List<String> missing = new ArrayList<>();
    for (SensorKind kind : SensorKind.values()) {
      if (sensors.getDefaultSensor(kind.androidType) == null) {
        missing.add(kind.name());
      }
    }
    return missing;
  }
}
