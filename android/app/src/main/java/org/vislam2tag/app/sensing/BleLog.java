package org.vislam2tag.app.sensing;

import android.bluetooth.BluetoothAdapter;
import android.bluetooth.le.BluetoothLeScanner;
import android.bluetooth.le.ScanCallback;
import android.bluetooth.le.ScanRecord;
import android.bluetooth.le.ScanResult;
import android.bluetooth.le.ScanSettings;
import org.vislam2tag.core.record.Beacon;
import org.vislam2tag.core.record.BleReading;
import org.vislam2tag.core.session.Recorder;

/** Bluetooth LE advertisements, all that are heard. */
public final class BleLog extends ScanCallback implements Feed {
  private final BluetoothAdapter adapter;
  private Recorder recorder;
  private BluetoothLeScanner scanner;

  /** Without Bluetooth ({@code adapter} null) it logs nothing. */
  public BleLog(BluetoothAdapter adapter) {
    this.adapter = adapter;
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
      scanner.startScan(null, settings.build(), this);
    } catch (SecurityException e) {
      scanner = null;
      into.event("no_bluetooth_permission", "");
    }
  }

  /** Ends listening; nothing happens where it was not started. */
  @Override public void stop() {
    if (scanner != null && adapter.isEnabled()) {
      try {
        scanner.stopScan(this);
      } catch (SecurityException e) {
        recorder.event("no_bluetooth_permission", "");
      }
    }
    scanner = null;
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
