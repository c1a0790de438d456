package org.vislam2tag.app.sensing;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;
import static org.mockito.ArgumentMatchers.any;
import static org.mockito.ArgumentMatchers.anyBoolean;
import static org.mockito.ArgumentMatchers.anyString;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.verify;
import static org.mockito.Mockito.when;

import android.content.Context;
import android.content.Intent;
import android.net.wifi.ScanResult;
import android.net.wifi.WifiManager;
import android.os.Handler;
import java.util.Collections;
import java.util.List;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.Recorded;
import org.vislam2tag.app.recording.PhoneClocks;

public class WifiLogTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final WifiManager wifi = mock(WifiManager.class);
  private final Context context = mock(Context.class);
  private final Intent results = mock(Intent.class);
  private Recorded recorded;
  private WifiLog log;

  @Before public void start() throws Exception {
    recorded = new Recorded(folder.getRoot());
    log = new WifiLog(context, wifi, mock(Handler.class), new PhoneClocks());
  }

  @Test public void readingsBecomeRows() throws Exception {
    ScanResult heard = mock(ScanResult.class);
    heard.BSSID = "02:11:22:33:44:55";
    heard.SSID = "a, \"b\"";
    heard.level = -61;
    heard.frequency = 5180;
    heard.timestamp = 84211002345L;
    heard.channelWidth = ScanResult.CHANNEL_WIDTH_80MHZ;
    heard.centerFreq0 = 5210;
    when(wifi.getScanResults()).thenReturn(Collections.singletonList(heard));
    when(results.getBooleanExtra(anyString(), anyBoolean())).thenReturn(true);
    log.start(recorded.recorder);
    log.onReceive(context, results);
    List<String> rows = recorded.rows("WiFi.csv");
    assertEquals(1, rows.size());
    assertTrue(rows.get(0), rows.get(0).contains("02:11:22:33:44:55,\"a, \"\"b\"\"\",-61,5180,80,5210"));
  }

  @Test public void aRefusedScanIsAnEvent() throws Exception {
    when(wifi.startScan()).thenReturn(false);
    log.start(recorded.recorder);
    log.look();
    assertTrue(recorded.events().contains("scan_refused,"));
  }

  @Test public void aFailedScanIsAnEvent() throws Exception {
    when(wifi.getScanResults()).thenReturn(Collections.emptyList());
    log.start(recorded.recorder);
    log.onReceive(context, results);
    assertEquals(Collections.singletonList("scan_failed,"), recorded.events());
  }

  @Test public void hiddenReadingsAreToldByTheMissingPermission() throws Exception {
    when(wifi.getScanResults()).thenThrow(new SecurityException());
    log.start(recorded.recorder);
    log.onReceive(context, results);
    assertTrue(recorded.events().contains("no_location_permission,"));
  }

  @Test public void aPhoneWithoutWifiSaysSo() throws Exception {
    new WifiLog(context, null, mock(Handler.class), new PhoneClocks()).start(recorded.recorder);
    assertEquals(Collections.singletonList("wifi_off,no Wi-Fi in this phone"), recorded.events());
  }

  @Test public void stoppingStopsListeningOnce() {
    log.start(recorded.recorder);
    log.stop();
    log.stop();
    verify(context).unregisterReceiver(any());
  }
}
