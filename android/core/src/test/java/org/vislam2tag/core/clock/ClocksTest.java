package org.vislam2tag.core.clock;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNull;

import java.time.ZoneId;
import java.util.Locale;
import org.junit.After;
import org.junit.Test;

public class ClocksTest {
  private static final long S = 1_000_000_000L;
  private final Locale usual = Locale.getDefault();

  @After public void speakAsBefore() {
    Locale.setDefault(usual);
  }

  private static void frame(FrameClock clock, long exposedNs, long frameNs, long bootNs, long nanoNs) {
    ClockReading arrival = new ClockReading(bootNs, nanoNs, 0);
    assertEquals(clock, FrameClock.of(frameNs, arrival));
    assertEquals(exposedNs, clock.exposedNs(frameNs, arrival));
  }

  @Test public void aFrameIsOnTheClockThatItIsJustBehindOf() {
    frame(FrameClock.BOOT, 99 * S, 99 * S, 100 * S, 40 * S);
    frame(FrameClock.MONOTONIC, 99 * S, 39 * S, 100 * S, 40 * S);
    frame(FrameClock.UNKNOWN, 100 * S, 7 * S, 100 * S, 40 * S);
    frame(FrameClock.BOOT, 99 * S, 99 * S, 100 * S, 100 * S);
  }

  @Test public void aStampOfTheFutureOrOfTwoSecondsAgoIsOnNoClock() {
    frame(FrameClock.BOOT, 100 * S, 100 * S, 100 * S, 0);
    frame(FrameClock.UNKNOWN, 100 * S, 100 * S + 1, 100 * S, 0);
    frame(FrameClock.BOOT, 98 * S + 1, 98 * S + 1, 100 * S, 0);
    frame(FrameClock.UNKNOWN, 100 * S, 98 * S, 100 * S, 0);
  }

  @Test public void aSensorKeepsTheClockOfItsFirstReading() {
    ClockReading arrival = new ClockReading(1000 * S, 400 * S, 0);
    SensorClock boot = new SensorClock(995 * S, arrival);
    assertNull(boot.remark());
    assertEquals(7, boot.bootNs(7, 2000 * S));
    SensorClock monotonic = new SensorClock(401 * S, arrival);
    assertEquals("monotonic", monotonic.remark());
    assertEquals(1002 * S, monotonic.bootNs(402 * S, 2000 * S));
    SensorClock unknown = new SensorClock(989 * S, arrival);
    assertEquals("unknown", unknown.remark());
    assertEquals(2000 * S, unknown.bootNs(990 * S, 2000 * S));
  }

  @Test public void jumpsOfTheWallClockAreToldOnceWithTheirSign() {
    WallClockWatch watch = new WallClockWatch(new ClockReading(10 * S, 0, 50_000));
    assertEquals(0, watch.jumpMs(new ClockReading(20 * S, 0, 60_400)));
    assertEquals(3_600_000, watch.jumpMs(new ClockReading(30 * S, 0, 3_670_000)));
    assertEquals(0, watch.jumpMs(new ClockReading(31 * S, 0, 3_671_000)));
    assertEquals(-3_600_000, watch.jumpMs(new ClockReading(32 * S, 0, 72_000)));
  }

  @Test public void wallTimesReadTheSameInEveryLocale() {
    for (Locale locale : new Locale[] {Locale.GERMANY, Locale.forLanguageTag("ar-EG-u-nu-arab"),
        Locale.forLanguageTag("th-TH-u-ca-buddhist-nu-thai")}) {
      Locale.setDefault(locale);
      assertEquals("2021-12-20T13:25:23.417+01:00", WallTime.iso(1_640_003_123_417L, ZoneId.of("Europe/Berlin")));
      assertEquals("2021-12-20T12:25:23.417+00:00", WallTime.iso(1_640_003_123_417L, ZoneId.of("UTC")));
      assertEquals("2021-12-20T132523", WallTime.folderName(1_640_003_123_417L, ZoneId.of("Europe/Berlin")));
    }
  }
}
