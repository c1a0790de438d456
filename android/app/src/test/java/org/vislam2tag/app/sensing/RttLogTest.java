package org.vislam2tag.app.sensing;

import static org.junit.Assert.assertEquals;
import static org.mockito.ArgumentMatchers.any;
import static org.mockito.Mockito.doAnswer;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.never;
import static org.mockito.Mockito.verify;
import static org.mockito.Mockito.when;

import android.net.MacAddress;
import android.net.wifi.ScanResult;
import android.net.wifi.WifiManager;
import android.net.wifi.rtt.RangingResult;
import android.net.wifi.rtt.RangingResultCallback;
import android.net.wifi.rtt.WifiRttManager;
import android.os.Handler;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.Recorded;

public class RttLogTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final WifiManager wifi = mock(WifiManager.class);
  private final WifiRttManager rtt = mock(WifiRttManager.class);
  private final RttLog log = new RttLog(wifi, rtt, mock(Handler.class), 10);

  private void hears() {
    ScanResult point = mock(ScanResult.class);
    point.BSSID = "02:11:22:33:44:AB";
    when(point.is80211mcResponder()).thenReturn(true);
    when(wifi.getScanResults()).thenReturn(Collections.singletonList(point));
    when(rtt.isAvailable()).thenReturn(true);
  }

  private static RangingResult result(int status) {
    RangingResult result = mock(RangingResult.class);
    MacAddress address = mock(MacAddress.class);
    when(address.toString()).thenReturn("02:11:22:33:44:AB");
    when(result.getStatus()).thenReturn(status);
    when(result.getMacAddress()).thenReturn(address);
    when(result.getRangingTimestampMillis()).thenReturn(84211002L);
    when(result.getDistanceMm()).thenReturn(4310);
    when(result.getDistanceStdDevMm()).thenReturn(520);
    when(result.getRssi()).thenReturn(-55);
    when(result.getNumAttemptedMeasurements()).thenReturn(8);
    when(result.getNumSuccessfulMeasurements()).thenReturn(7);
    return result;
  }

  private void answers(List<RangingResult> results) {
    doAnswer(call -> {
      ((RangingResultCallback) call.getArgument(2)).onRangingResults(results);
      return null;
    }).when(rtt).startRanging(any(), any(), any());
  }

  @Test public void rangesThatSucceededAreRows() throws Exception {
    Recorded recorded = new Recorded(folder.getRoot());
    hears();
    answers(Arrays.asList(result(RangingResult.STATUS_FAIL), result(RangingResult.STATUS_SUCCESS)));
    log.start(recorded.recorder);
    log.ask();
    assertEquals(Collections.singletonList("02:11:22:33:44:ab,1,4.31,0.52,-55,8,7"), recorded.rows("Rtt.csv"));
  }

  @Test public void aFailureIsToldOnce() throws Exception {
    Recorded recorded = new Recorded(folder.getRoot());
    hears();
    doAnswer(call -> {
      ((RangingResultCallback) call.getArgument(2)).onRangingFailure(2);
      return null;
    }).when(rtt).startRanging(any(), any(), any());
    log.start(recorded.recorder);
    log.ask();
    log.ask();
    assertEquals(1, recorded.rows("Events.csv").stream().filter(row -> row.equals("ranging_failed,2")).count());
  }

  @Test public void nothingIsAskedWhileRangingIsNotAvailable() throws Exception {
    Recorded recorded = new Recorded(folder.getRoot());
    log.start(recorded.recorder);
    log.ask();
    verify(rtt, never()).startRanging(any(), any(), any());
    log.stop();
  }
}
