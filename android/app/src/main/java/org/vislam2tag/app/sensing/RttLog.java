package org.vislam2tag.app.sensing;

import android.content.Context;
import android.content.pm.PackageManager;
import android.net.wifi.ScanResult;
import android.net.wifi.WifiManager;
import android.net.wifi.rtt.RangingRequest;
import android.net.wifi.rtt.RangingResult;
import android.net.wifi.rtt.RangingResultCallback;
import android.net.wifi.rtt.WifiRttManager;
import android.os.Build;
import android.os.Handler;
import java.util.HashMap;
import java.util.List;
import java.util.Locale;
import java.util.Map;
import org.vislam2tag.core.radio.RttPeers;
import org.vislam2tag.core.record.RttReading;
import org.vislam2tag.core.session.Recorder;

/** Ranges to access points, burst after burst, where the phone can measure them. Lives on the handler's thread. */
public final class RttLog implements Feed {
  private static final int ANDROID_12 = 31;
  private static final long PERIOD_MS = 1000;

  private final WifiManager wifi;
  private final WifiRttManager rtt;
  private final Handler handler;
  private final int most;
  private final Runnable ask = this::ask;
  private final Map<String, Boolean> answers = new HashMap<>();
  private Recorder recorder;
  private int failure;

  /** Asks so many access points at once at most. */
  RttLog(WifiManager wifi, WifiRttManager rtt, Handler handler, int most) {
    this.wifi = wifi;
    this.rtt = rtt;
    this.handler = handler;
    this.most = most;
  }

  /** Of this phone; it logs nothing where the phone cannot measure ranges. */
  public static RttLog of(Context context, WifiManager wifi, Handler handler) {
    boolean can = Build.VERSION.SDK_INT >= Build.VERSION_CODES.P && wifi != null
        && context.getPackageManager().hasSystemFeature(PackageManager.FEATURE_WIFI_RTT);
    WifiRttManager rtt = can ? (WifiRttManager) context.getSystemService(Context.WIFI_RTT_RANGING_SERVICE) : null;
    return new RttLog(wifi, rtt, handler, can ? RangingRequest.getMaxPeers() : 0);
  }

  @Override public void start(Recorder into) {
    recorder = into;
    if (rtt != null) {
      handler.post(ask);
    }
  }

  @Override public void stop() {
    handler.removeCallbacks(ask);
    recorder = null;
  }

  /** Asks for ranges to what was heard last, and asks again soon. */
  void ask() {
    handler.postDelayed(ask, PERIOD_MS);
    if (!rtt.isAvailable()) {
      return; // Wi-Fi is off, or used otherwise
    }
    boolean others = Build.VERSION.SDK_INT >= ANDROID_12;
    try {
      List<ScanResult> peers =
          RttPeers.choose(wifi.getScanResults(), point -> point.level, ScanResult::is80211mcResponder, others, most);
      if (!peers.isEmpty()) {
        rtt.startRanging(request(peers), handler::post, new Answer());
      }
    } catch (SecurityException e) {
      failed(-1);
    }
  }

  private RangingRequest request(List<ScanResult> peers) {
    RangingRequest.Builder request = new RangingRequest.Builder();
    for (ScanResult peer : peers) {
      answers.put(peer.BSSID.toLowerCase(Locale.ROOT), peer.is80211mcResponder());
      if (peer.is80211mcResponder()) {
        request.addAccessPoint(peer);
      } else {
        request.addNon80211mcCapableAccessPoint(peer);
      }
    }
    return request.build();
  }

  /** Told once, until it succeeds again or fails for another reason. */
  private void failed(int code) {
    if (recorder != null && code != failure) {
      recorder.event("ranging_failed", Integer.toString(code));
    }
    failure = code;
  }

  private final class Answer extends RangingResultCallback {
    @Override public void onRangingFailure(int code) {
      failed(code);
    }

    @Override public void onRangingResults(List<RangingResult> results) {
      failure = 0;
      for (RangingResult result : results) {
        if (recorder != null && result.getStatus() == RangingResult.STATUS_SUCCESS) {
          String bssid = String.valueOf(result.getMacAddress()).toLowerCase(Locale.ROOT);
          recorder.range(new RttReading(result.getRangingTimestampMillis(), bssid, answers.getOrDefault(bssid, false),
              result.getDistanceMm(), result.getDistanceStdDevMm(), result.getRssi(), result.getNumAttemptedMeasurements(),
              result.getNumSuccessfulMeasurements()));
        }
      }
    }
  }
}
