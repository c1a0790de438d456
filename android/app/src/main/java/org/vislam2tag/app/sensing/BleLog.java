package org.vislam2tag.app.sensing;

import android.bluetooth.BluetoothAdapter;
import android.bluetooth.le.BluetoothLeScanner;
import android.bluetooth.le.ScanCallback;
import android.bluetooth.le.ScanFilter;
import android.bluetooth.le.ScanRecord;
import android.bluetooth.le.ScanResult;
import android.bluetooth.le.ScanSettings;
import android.os.Handler;
import android.os.ParcelUuid;
import java.util.Arrays;
import java.util.List;
import org.vislam2tag.core.record.Beacon;
import org.vislam2tag.core.record.BleReading;
import org.vislam2tag.core.session.Recorder;

/**
 * Bluetooth LE advertisements: all that are heard, and while the screen is off, when Android brings nothing to who asks for
 * all, those of beacons (iBeacon, Eddystone).
 */
public final class BleLog extends ScanCallback implements Feed {
  /** Android quietly slows a scan down that runs for longer: 30 minutes at first, 10 in newer versions. */
  static final long RENEW_MS = 8 * 60 * 1000;

  /** Android quietly refuses a sixth start within 30 s: how long a screen that went on or off must stay so. */
  static final long SCREEN_MS = 7000;
  private static final byte[] IBEACON = {2, 0x15};
  private static final ParcelUuid EDDYSTONE = ParcelUuid.fromString("0000feaa-0000-1000-8000-00805f9b34fb");

  private final BluetoothAdapter adapter;
  private final Handler handler;
  private final Runnable renew = this::renew;
  private Recorder recorder;
  private BluetoothLeScanner scanner;
  private boolean screenOff;

  /** Without Bluetooth ({@code adapter} null) it logs nothing. */
  public BleLog(BluetoothAdapter adapter, Handler handler) {
    this.adapter = adapter;
    this.handler = handler;
  }

  /** Starts listening; also to be called when Bluetooth was switched on. */
  @Override public void start(Recorder into) {
    recorder = into;
    scanner = adapter == null || !adapter.isEnabled() ? null : adapter.getBluetoothLeScanner();
    if (scanner == null) {
      into.event("bluetooth_off", adapter == null ? "no Bluetooth in this phone" : "");
      return;
    }
    try {
      ScanSettings.Builder settings = new ScanSettings.Builder();
      settings.setScanMode(ScanSettings.SCAN_MODE_LOW_LATENCY);
      scanner.startScan(screenOff ? beacons() : null, settings.build(), this);
      handler.removeCallbacks(renew);
      handler.postDelayed(renew, RENEW_MS);
    } catch (SecurityException e) {
      scanner = null;
      into.event("no_bluetooth_permission", "");
    }
  }

  /** Ends listening; nothing happens where it was not started. */
  @Override public void stop() {
    handler.removeCallbacks(renew);
    if (scanner != null && adapter.isEnabled()) {
      try {
        scanner.stopScan(this);
      } catch (SecurityException e) {
        recorder.event("no_bluetooth_permission", "");
      }
    }
    scanner = null;
  }

  /** The screen went on or off. */
  void screen(boolean on) {
    screenOff = !on;
    if (scanner != null) {
      handler.removeCallbacks(renew);
      handler.postDelayed(renew, SCREEN_MS);
    }
  }

  private static List<ScanFilter> beacons() {
    ScanFilter.Builder ibeacon = new ScanFilter.Builder();
    ibeacon.setManufacturerData(Beacon.COMPANY, IBEACON);
    ScanFilter.Builder eddystone = new ScanFilter.Builder();
    eddystone.setServiceUuid(EDDYSTONE);
    return Arrays.asList(ibeacon.build(), eddystone.build());
  }

  /** Ends the scan and begins it again. */
  void renew() {
    if (scanner != null && adapter.isEnabled()) {
      stop();
      start(recorder);
    }
  }

  @Override public void onScanResult(int callbackType, ScanResult result) {
    ScanRecord record = result.getScanRecord();
    byte[] apple = record == null ? null : record.getManufacturerSpecificData(Beacon.COMPANY);
    recorder.ble(new BleReading(result.getTimestampNanos(), result.getDevice().getAddress(),
        record == null ? null : record.getDeviceName(), result.getRssi(), txPowerDbm(result, record),
        Beacon.of(Beacon.COMPANY, apple)));
  }

  @Override public void onScanFailed(int errorCode) {
    recorder.event("ble_scan_failed", Integer.toString(errorCode));
  }

  private static int txPowerDbm(ScanResult result, ScanRecord record) {
    if (result.getTxPower() != ScanResult.TX_POWER_NOT_PRESENT) {
      return result.getTxPower();
    }
    return record == null ? BleReading.NO_TX_POWER : record.getTxPowerLevel();
  }
}
