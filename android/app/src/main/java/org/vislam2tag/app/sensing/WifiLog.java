package org.vislam2tag.app.sensing;

import android.content.BroadcastReceiver;
import android.content.Context;
import android.content.Intent;
import android.content.IntentFilter;
import android.net.wifi.ScanResult;
import android.net.wifi.WifiManager;
import android.os.Build;
import android.os.Handler;
import java.util.ArrayList;
import java.util.List;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.radio.ScanPacer;
import org.vislam2tag.core.record.WifiReading;
import org.vislam2tag.core.session.Recorder;

/** Wi-Fi scans, one after the other as fast as the platform lets. Lives on the handler's thread. */
public final class WifiLog extends BroadcastReceiver implements Feed {
  private static final long LOOK_MS = 250;

  private final Context context;
  private final WifiManager wifi;
  private final Handler handler;
  private final Clocks clocks;
  private final ScanPacer pacer = new ScanPacer();
  private final Runnable look = this::look;
  private Recorder recorder;

  /** Without Wi-Fi ({@code wifi} null) it logs nothing. */
  public WifiLog(Context context, WifiManager wifi, Handler handler, Clocks clocks) {
    this.context = context;
    this.wifi = wifi;
    this.handler = handler;
    this.clocks = clocks;
  }

  /** Starts scanning. */
  @Override public void start(Recorder into) {
    recorder = into;
    if (wifi == null) {
      into.event("wifi_off", "no Wi-Fi in this phone");
      return;
    }
    context.registerReceiver(this, new IntentFilter(WifiManager.SCAN_RESULTS_AVAILABLE_ACTION), null, handler);
    handler.post(look);
  }

  /** Ends scanning; nothing happens where it was not started. */
  @Override public void stop() {
    if (recorder == null || wifi == null) {
      return;
    }
    handler.removeCallbacks(look);
    context.unregisterReceiver(this);
    recorder = null;
  }

  @Override public void onReceive(Context from, Intent intent) {
    if (recorder == null) {
      return;
    }
    boolean fresh = intent.getBooleanExtra(WifiManager.EXTRA_RESULTS_UPDATED, false);
    recorder.scanDelivered(fresh, readings());
    pacer.delivered(nowNs());
  }

  /** Asks for a scan where one is due, and looks again soon. */
  @SuppressWarnings("deprecation") // there is no other call that asks for a scan
  void look() {
    tellThrottling();
    long now = nowNs();
    if (pacer.isDue(now)) {
      boolean accepted = wifi.startScan();
      pacer.asked(now, accepted);
      if (accepted) {
        recorder.scanAccepted();
      } else {
        recorder.scanRefused();
      }
    }
    handler.postDelayed(look, LOOK_MS);
  }

  private void tellThrottling() {
    if (Build.VERSION.SDK_INT >= 30) {
      boolean on = wifi.isScanThrottleEnabled();
      pacer.throttling(on);
      recorder.throttling(on);
    }
  }

  private List<WifiReading> readings() {
    List<WifiReading> readings = new ArrayList<>();
    try {
      for (ScanResult result : wifi.getScanResults()) {
        readings.add(new WifiReading(result.timestamp, result.BSSID, result.SSID, result.level, result.frequency,
            WifiReading.widthMhz(result.channelWidth), result.centerFreq0, result.centerFreq1));
      }
    } catch (SecurityException e) {
      recorder.event("no_location_permission", "");
    }
    return readings;
  }

  private long nowNs() {
    return clocks.read().bootNs;
  }
}
