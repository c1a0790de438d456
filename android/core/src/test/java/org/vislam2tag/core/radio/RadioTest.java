package org.vislam2tag.core.radio;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;

import java.util.ArrayDeque;
import java.util.Arrays;
import java.util.List;
import org.junit.Test;
import org.vislam2tag.core.record.WifiReading;

public class RadioTest {
  private static final long S = 1_000_000_000L;

  private static WifiReading heard(String bssid, long timestampUs) {
    return new WifiReading(timestampUs, bssid, "", -60, 2412, 20, 0, 0);
  }

  @Test public void deliveriesAreNumberedAndKeptWholeAndWhatIsNewIsCounted() {
    ScanLog log = new ScanLog();
    List<WifiReading> first = Arrays.asList(heard("a", 1), heard("b", 1));
    assertEquals(2, log.delivered(5, true, first).size());
    assertEquals(2, log.delivered(6, false, Arrays.asList(heard("a", 1), heard("b", 9))).size());
    log.refused();
    assertEquals(2, log.deliveries());
    assertEquals(3, log.newReadings());
    assertEquals(1, log.failures());
    assertEquals(1, log.refusals());
  }

  @Test public void throttlingIsNewsOnlyWhenItChanges() {
    ScanLog log = new ScanLog();
    assertEquals(null, log.throttling());
    assertTrue(log.throttling(true));
    assertFalse(log.throttling(true));
    assertTrue(log.throttling(false));
    assertEquals("off", log.throttling());
  }

  @Test public void withoutThrottlingTheNextScanFollowsTheLast() {
    ScanPacer pacer = new ScanPacer();
    assertTrue(pacer.isDue(0));
    pacer.asked(0, true);
    assertFalse(pacer.isDue(3 * S));
    pacer.delivered(3 * S);
    assertFalse(pacer.isDue(3 * S));
    assertTrue(pacer.isDue(3 * S + ScanPacer.PAUSE_NS));
  }

  @Test public void aScanWithoutResultsIsAskedForAgain() {
    ScanPacer pacer = new ScanPacer();
    pacer.asked(0, true);
    assertTrue(pacer.isDue(ScanPacer.LONGEST_SCAN_NS));
    pacer.asked(20 * S, false);
    assertFalse(pacer.isDue(21 * S));
    assertTrue(pacer.isDue(20 * S + ScanPacer.RETRY_NS));
    assertFalse(pacer.isThrottled());
  }

  /** Plays a phone that allows four scans in two minutes, as Android says. */
  private static int accepted(ScanPacer pacer, int seconds, long[] refused) {
    ArrayDeque<Long> allowed = new ArrayDeque<>();
    int accepted = 0;
    for (long now = 0; now < seconds * S; now += S / 2) {
      if (!pacer.isDue(now)) {
        continue;
      }
      while (!allowed.isEmpty() && now - allowed.peekFirst() >= 120 * S) {
        allowed.removeFirst();
      }
      boolean ok = allowed.size() < 4;
      pacer.asked(now, ok);
      if (ok) {
        allowed.addLast(now);
        accepted++;
        pacer.delivered(now);
      } else {
        refused[0]++;
      }
    }
    return accepted;
  }

  @Test public void aThrottledPhoneIsAskedEvenlyAndNeverRefuses() {
    ScanPacer pacer = new ScanPacer();
    pacer.throttling(true);
    long[] refused = {0};
    assertEquals(20, accepted(pacer, 600, refused));
    assertEquals(0, refused[0]);
  }

  @Test public void throttlingThatNobodyToldIsSeenFromTheRefusal() {
    ScanPacer pacer = new ScanPacer();
    long[] refused = {0};
    assertTrue(accepted(pacer, 600, refused) >= 19);
    assertEquals(1, refused[0]);
    assertTrue(pacer.isThrottled());
  }

  @Test public void aRadioThatFallsSilentWithTheScreenOffIsNoticedOnce() {
    SilenceWatch watch = new SilenceWatch();
    long last = 10 * S;
    watch.heard(last);
    watch.expect();
    watch.screen(false, 11 * S);
    assertFalse(watch.fellSilent(11 * S + SilenceWatch.SILENT_NS - 1));
    assertTrue(watch.fellSilent(11 * S + SilenceWatch.SILENT_NS));
    assertFalse(watch.fellSilent(12 * S + SilenceWatch.SILENT_NS));
    watch.screen(true, 13 * S + SilenceWatch.SILENT_NS);
    assertEquals(109, watch.silentS(120 * S), 1e-9);
    assertEquals(110, watch.heard(121 * S), 1e-9);
    assertEquals(0, watch.heard(122 * S), 0);
    assertEquals(110, watch.silentS(500 * S), 1e-9);
  }

  @Test public void silenceWithTheScreenOnOrWithoutAnythingAskedForIsNone() {
    SilenceWatch watch = new SilenceWatch();
    watch.expect();
    assertFalse(watch.fellSilent(1000 * S));
    SilenceWatch idle = new SilenceWatch();
    idle.screen(false, 0);
    assertFalse(idle.fellSilent(1000 * S));
  }

  @Test public void scansOfAThrottledPhoneAreNoSilence() {
    SilenceWatch watch = new SilenceWatch();
    watch.screen(false, 0);
    for (long now = 0; now < 1000 * S; now += 30 * S) {
      watch.expect();
      assertFalse(watch.fellSilent(now));
      assertEquals(0, watch.heard(now), 0);
    }
  }

  @Test public void whenThrottlingIsSwitchedOffScansAreDueAtOnce() {
    ScanPacer pacer = new ScanPacer();
    pacer.throttling(true);
    pacer.asked(0, true);
    assertFalse(pacer.isDue(20 * S));
    pacer.throttling(false);
    assertTrue(pacer.isDue(20 * S));
  }
}
