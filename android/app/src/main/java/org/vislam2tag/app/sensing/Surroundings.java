package org.vislam2tag.app.sensing;

import android.bluetooth.BluetoothAdapter;
import android.content.BroadcastReceiver;
import android.content.Context;
import android.content.Intent;
import android.content.IntentFilter;
import android.location.LocationManager;
import android.net.wifi.WifiManager;
import android.os.BatteryManager;
import org.vislam2tag.core.session.Recorder;

/** What happens to the phone while a session is recorded: switches, screen, battery. */
public final class Surroundings extends BroadcastReceiver implements Feed {

  private final Context context;
  private final BleLog ble;
  private final LocationManager location;
  private Recorder recorder;
  private boolean locationOn = true;

  /** {@code ble} listens again when Bluetooth comes back. */
  public Surroundings(Context context, BleLog ble, LocationManager location) {
    this.context = context;
    this.ble = ble;
    this.location = location;
  }

  /** Starts watching. */
  @Override public void start(Recorder into) {
    recorder = into;
    IntentFilter filter = new IntentFilter();
    filter.addAction(WifiManager.WIFI_STATE_CHANGED_ACTION);
    filter.addAction(BluetoothAdapter.ACTION_STATE_CHANGED);
    filter.addAction(LocationManager.MODE_CHANGED_ACTION);
    filter.addAction(Intent.ACTION_SCREEN_OFF);
    filter.addAction(Intent.ACTION_SCREEN_ON);
    filter.addAction(Intent.ACTION_BATTERY_CHANGED);
    context.registerReceiver(this, filter);
    tellLocation();
  }

  /** Ends watching; nothing happens where it was not started. */
  @Override public void stop() {
    if (recorder != null) {
      context.unregisterReceiver(this);
      recorder = null;
    }
  }

  @Override public void onReceive(Context from, Intent intent) {
    if (recorder == null || intent.getAction() == null) {
      return;
    }
    switch (intent.getAction()) {
      case WifiManager.WIFI_STATE_CHANGED_ACTION:
        wifi(intent.getIntExtra(WifiManager.EXTRA_WIFI_STATE, WifiManager.WIFI_STATE_UNKNOWN));
        break;
      case BluetoothAdapter.ACTION_STATE_CHANGED:
        bluetooth(intent.getIntExtra(BluetoothAdapter.EXTRA_STATE, BluetoothAdapter.ERROR));
        break;
      case LocationManager.MODE_CHANGED_ACTION:
        tellLocation();
        break;
      case Intent.ACTION_BATTERY_CHANGED:
        recorder.battery(percent(intent));
        break;
      case Intent.ACTION_SCREEN_OFF:
        screen(false);
        break;
      default:
        screen(true);
        break;
    }
  }

  private void screen(boolean on) {
    recorder.screen(on);
    ble.screen(on);
  }

  private void wifi(int state) {
    if (state == WifiManager.WIFI_STATE_DISABLED || state == WifiManager.WIFI_STATE_ENABLED) {
      recorder.event(state == WifiManager.WIFI_STATE_ENABLED ? "wifi_on" : "wifi_off", "");
    }
  }

  private void bluetooth(int state) {
    if (state == BluetoothAdapter.STATE_ON) {
      recorder.event("bluetooth_on", "");
      ble.start(recorder);
    } else if (state == BluetoothAdapter.STATE_OFF) {
      recorder.event("bluetooth_off", "");
    }
  }

  /** Is any way of finding the place switched on? {@code location} may be null. */
  public static boolean isLocationOn(LocationManager location) {
    return location != null && (location.isProviderEnabled(LocationManager.GPS_PROVIDER)
        || location.isProviderEnabled(LocationManager.NETWORK_PROVIDER));
  }

  /** Without location services Android hands out no scans. */
  private void tellLocation() {
    boolean on = isLocationOn(location);
    if (on != locationOn) {
      locationOn = on;
      recorder.event(on ? "location_on" : "location_off", "");
    }
  }

  private static int percent(Intent battery) {
    int level = battery.getIntExtra(BatteryManager.EXTRA_LEVEL, 100);
    int scale = battery.getIntExtra(BatteryManager.EXTRA_SCALE, 100);
    return scale > 0 ? 100 * level / scale : 100;
  }
}
