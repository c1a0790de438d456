package org.vislam2tag.core.session;

import static org.junit.Assert.assertArrayEquals;
import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertNotNull;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;
import static org.junit.Assert.fail;

import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.Locale;
import java.util.Map;
import org.junit.After;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.TestClocks;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.record.BleReading;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;
import org.vislam2tag.core.record.WifiReading;
import org.vislam2tag.core.table.FileSink;
import org.vislam2tag.core.table.RowSink;
import org.vislam2tag.core.table.Table;
import org.vislam2tag.core.tracking.AnchorHost;
import org.vislam2tag.core.walk.Warning;

public class RecorderTest {
  @Rule public final TemporaryFolder temporary = new TemporaryFolder();
  private final Locale usual = Locale.getDefault();
  private final TestClocks clocks = new TestClocks();
  private final List<Warning> warned = new ArrayList<>();
  private final List<Radio> stopped = new ArrayList<>();
  private final List<SessionEnd> ended = new ArrayList<>();
  private long freeBytes = 10L << 30;
  private final RecorderListener listener = new RecorderListener() {
    @Override public void warning(Warning warning) {
      warned.add(warning);
    }

    @Override public void caught(String landmark) {}

    @Override public void scansStopped(Radio radio) {
      stopped.add(radio);
    }

    @Override public void ended(SessionEnd end) {
      ended.add(end);
    }
  };
  private final AnchorHost anchors = new AnchorHost() {
    @Override public boolean set(int number, Pose pose) {
      return true;
    }

    @Override public State get(int number) {
      return new State(TrackingState.TRACKING, new Pose(0, 0, 0, 0, 0, 0, 1));
    }

    @Override public void detach(int number) {}
  };

  @Before public void speakGerman() {
    Locale.setDefault(Locale.GERMANY);
  }

  @After public void speakAsBefore() {
    Locale.setDefault(usual);
  }

  private Recorder start() throws IOException {
    return start(FileSink::new);
  }

  private Recorder start(RowSink.Opener opener) throws IOException {
    SessionDescription description = new SessionDescription.Builder().place("Main building", 4).device("LG")
        .note("evening, \"few\" people").app("1.0.0").phone("LGE", "LM-G900", "11", 30, "1.43.0")
        .sensor(new SensorOn(SensorKind.ACC, "LSM6DSO", "STMicro", 200))
        .sensor(new SensorOn(SensorKind.MAG, "AK", "AKM", SensorOn.FASTEST)).landmarks(24, "7").build();
    return Recorder.start(new Recorder.Setup(clocks, RecorderSettings.usual(), listener, opener, () -> freeBytes), description,
        temporary.getRoot());
  }

  private void frame(Recorder recorder, TrackingState state, float x, TrackedImage... images) {
    clocks.pass(0.033);
    recorder.frame(new TrackedFrame(clocks.read(), clocks.bootNs - 30_000_000, state, "NONE", new Pose(x, 0, 0, 0, 0, 0, 1),
        Arrays.asList(images)), anchors);
  }

  private static List<String> rows(Recorder recorder, Table table) throws IOException {
    byte[] bytes = Files.readAllBytes(new File(recorder.folder(), table.fileName).toPath());
    List<String> lines = new ArrayList<>(Arrays.asList(new String(bytes, StandardCharsets.UTF_8).split("\n")));
    assertEquals(table.header, lines.remove(0));
    return lines;
  }

  /** Events without their times. */
  private static List<String> events(Recorder recorder) throws IOException {
    List<String> events = new ArrayList<>();
    for (String row : rows(recorder, Table.EVENTS)) {
      events.add(row.substring(row.indexOf(',') + 1));
    }
    return events;
  }

  private static Map<String, Object> json(Recorder recorder) throws IOException {
    return SessionFiles.readJson(recorder.folder());
  }

  @Test public void tapsOnThePlanAreFixesAndCanBeTakenBack() throws IOException {
    Recorder recorder = start();
    recorder.tap(1, 2, 0.6f);
    recorder.tap(3, 4, 0.6f);
    recorder.undoPress();
    recorder.press();
    recorder.undoPress();
    assertEquals(1, recorder.taps().size());
    assertEquals(1, recorder.status().presses);
    recorder.stop();
    String at = clocks.bootNs + ",";
    assertEquals(Arrays.asList(at + "0,tap,1.0,2.0,0.6", at + "1,tap,3.0,4.0,0.6", at + "1,undo,,,", at + "2,press,,,", at + "2,undo,,,"),
        rows(recorder, Table.PRESSES));
  }

  @Test public void scansThatStopWithTheScreenOffAreTold() throws IOException {
    Recorder recorder = start();
    recorder.scanAccepted();
    recorder.scanDelivered(true, Collections.emptyList());
    recorder.scanAccepted();
    recorder.screen(false);
    clocks.pass(100);
    recorder.tick();
    recorder.tick();
    assertEquals(Collections.singletonList(Radio.WIFI), stopped); // no Bluetooth was ever heard
    assertEquals(100, recorder.status().silentS.get(Radio.WIFI), 1e-6);
    recorder.scanDelivered(false, Collections.emptyList()); // brings nothing new
    recorder.screen(true);
    clocks.pass(20);
    recorder.scanDelivered(true, Collections.emptyList());
    recorder.stop();
    assertEquals(Arrays.asList("started,", "screen_off,", "scans_stopped,wifi", "scan_failed,", "screen_on,",
        "scans_resumed,wifi 120", "stopped,"), events(recorder));
  }

  @Test public void aSessionHasAllFilesFromTheStartAndNothingElse() throws IOException {
    Recorder recorder = start();
    assertEquals("2021-12-20T132523", recorder.folder().getName());
    List<String> expected = new ArrayList<>(Collections.singletonList("session.json"));
    for (Table table : Table.values()) {
      expected.add(table.fileName);
      assertEquals(Collections.emptyList(), rows(recorder, table));
    }
    String[] found = recorder.folder().list();
    Arrays.sort(found);
    Collections.sort(expected);
    assertArrayEquals(expected.toArray(), found);
    assertTrue(json(recorder).containsKey("end"));
    assertNull(json(recorder).get("end"));
    recorder.stop();
    assertArrayEquals("the space kept in reserve is given up", new String[] {"2021-12-20T132523"}, temporary.getRoot().list());
  }

  @Test public void sessionJsonSaysWhoWhereWhenAndHowItEnded() throws IOException {
    Recorder recorder = start();
    clocks.sleptNs = 5_000_000_000L;
    clocks.pass(60);
    assertEquals(EndState.STOPPED, recorder.stop().state);
    String text = new String(Files.readAllBytes(new File(recorder.folder(), "session.json").toPath()), StandardCharsets.UTF_8);
    String expected = "{format=vislam2tag-phone, version=1, session=2021-12-20T132523, site=Main building, floor=4, device=LG, "
        + "note=evening, \"few\" people, app={version=1.0.0}, "
        + "phone={manufacturer=LGE, model=LM-G900, android=11, api=30, arcore=1.43.0}, "
        + "start={wall=2021-12-20T13:25:23.417+01:00, wall_ms=1640003123417, boot_ns=1000000000000, nano_ns=1000000000000}, "
        + "end={state=stopped, detail=, wall=2021-12-20T13:26:23.417+01:00, wall_ms=1640003183417, "
        + "boot_ns=1060000000000, nano_ns=1055000000000}, "
        + "sensors=[{sensor=ACC, name=LSM6DSO, vendor=STMicro, rate_hz=200}, {sensor=MAG, name=AK, vendor=AKM, rate_hz=null}], "
        + "landmarks={loaded=24, refused=[7]}}";
    assertEquals(text, expected, json(recorder).toString());
    assertEquals(1, ended.size());
  }

  @Test public void twoSessionsInOneSecondHaveTwoNames() throws IOException {
    assertEquals("2021-12-20T132523", start().folder().getName());
    assertEquals("2021-12-20T132523-2", start().folder().getName());
    assertEquals("2021-12-20T132523-3", start().folder().getName());
  }

  @Test public void whatIsToldIsOnDiskAfterATick() throws IOException {
    Recorder recorder = start();
    frame(recorder, TrackingState.TRACKING, 0.5f);
    recorder.sensor(SensorKind.ACC, clocks.bootNs, new float[] {0.5f, 9.81f, -1e-5f}, 3);
    assertEquals(0, rows(recorder, Table.CAMERA).size());
    recorder.tick();
    assertEquals(1, rows(recorder, Table.CAMERA).size());
    assertEquals(1, rows(recorder, Table.ANCHORS).size());
    assertEquals(clocks.bootNs + ",ACC,0.5,9.81,-1.0E-5,,,,3", rows(recorder, Table.SENSORS).get(0));
    recorder.stop();
  }

  @Test public void framesThatAreNotNewOrNotLaterAreNotLogged() throws IOException {
    Recorder recorder = start();
    Pose pose = new Pose(0, 0, 0, 0, 0, 0, 1);
    clocks.pass(1);
    long[] stamps = {0, clocks.bootNs - 10, clocks.bootNs - 10, clocks.bootNs - 20, clocks.bootNs - 30, clocks.bootNs - 5};
    for (long stamp : stamps) {
      recorder.frame(new TrackedFrame(clocks.read(), stamp, TrackingState.PAUSED, "NONE", pose, Collections.emptyList()), anchors);
    }
    clocks.pass(1.5);
    for (long stamp : new long[] {clocks.bootNs - 1_600_000_000L, clocks.bootNs - 1_700_000_000L}) {
      recorder.frame(new TrackedFrame(clocks.read(), stamp, TrackingState.PAUSED, "NONE", pose, Collections.emptyList()), anchors);
    }
    recorder.stop();
    assertEquals(2, rows(recorder, Table.CAMERA).size());
    assertEquals(Arrays.asList("started,", "frame_clock,boot", "frames_backward,1", "frames_backward,2", "frames_backward,1",
        "stopped,"),
        events(recorder));
  }

  @Test public void aNewTrackingSessionIsANewPart() throws IOException {
    Recorder recorder = start();
    TrackedImage image = new TrackedImage("7", TrackingState.TRACKING, "FULL_TRACKING", new Pose(1, 0, 0, 0, 0, 0, 1), 0, 0);
    TrackedImage outline = new TrackedImage("7", TrackingState.PAUSED, "NOT_TRACKING", new Pose(1, 0, 0, 0, 0, 0, 1), 0, 0);
    recorder.newPart();
    frame(recorder, TrackingState.TRACKING, 0, image);
    recorder.camera(false, "phone_call");
    recorder.newPart();
    recorder.newPart();
    recorder.camera(true, "");
    frame(recorder, TrackingState.TRACKING, 9, outline);
    assertEquals(1, recorder.status().part);
    recorder.stop();
    List<String> frames = rows(recorder, Table.CAMERA);
    assertTrue(frames.get(0), frames.get(0).contains(",boot,0,TRACKING,"));
    assertTrue(frames.get(1), frames.get(1).contains(",boot,1,TRACKING,"));
    assertEquals(1, rows(recorder, Table.LANDMARKS).size());
    assertTrue(rows(recorder, Table.ANCHORS).get(1).contains(",1,TRACKING,"));
    assertEquals(Arrays.asList("started,", "frame_clock,boot", "camera_unavailable,phone_call", "camera_available,", "part,1",
        "stopped,"), events(recorder));
  }

  @Test public void sensorsOnAnotherClockAreBroughtToTheBootClockAndTold() throws IOException {
    Recorder recorder = start();
    clocks.sleptNs = 100_000_000_000L;
    recorder.sensor(SensorKind.GYRO, clocks.read().nanoNs - 5, new float[3], 2);
    recorder.sensor(SensorKind.MAG, 77, new float[3], 3);
    recorder.stop();
    assertTrue(rows(recorder, Table.SENSORS).get(0).startsWith((clocks.bootNs - 5) + ",GYRO,"));
    assertTrue(rows(recorder, Table.SENSORS).get(1).startsWith(clocks.bootNs + ",MAG,"));
    assertEquals(Arrays.asList("started,", "sensor_clock,GYRO monotonic", "sensor_clock,MAG unknown", "stopped,"), events(recorder));
  }

  @Test public void scansAreNumberedAndRefusalsTold() throws IOException {
    Recorder recorder = start();
    recorder.throttling(true);
    recorder.throttling(true);
    List<WifiReading> heard = Collections.singletonList(new WifiReading(5, "AA:bb", "x\ny\uD800", -60, 2412, 20, 0, 0));
    recorder.scanDelivered(true, heard);
    recorder.scanRefused();
    recorder.throttling(false);
    recorder.scanDelivered(false, heard);
    RecorderStatus status = recorder.status();
    recorder.stop();
    assertEquals(Arrays.asList("5000,0,aa:bb,x\uFFFDy\uFFFD,-60,2412,20,,," + clocks.bootNs + ",fresh,on",
        "5000,1,aa:bb,x\uFFFDy\uFFFD,-60,2412,20,,," + clocks.bootNs + ",cached,off"), rows(recorder, Table.WIFI));
    assertEquals(Arrays.asList("started,", "scan_throttling,on", "scan_refused,", "scan_throttling,off", "scan_failed,", "stopped,"),
        events(recorder));
    assertEquals(2, status.scans);
    assertEquals(1, status.scansRefused);
    assertEquals(1, status.wifiReadings);
  }

  @Test public void pressesAreNumberedAndUndone() throws IOException {
    Recorder recorder = start();
    recorder.undoPress();
    recorder.press();
    recorder.press();
    recorder.undoPress();
    recorder.press();
    assertEquals(2, recorder.status().presses);
    recorder.stop();
    String now = clocks.bootNs + ",";
    assertEquals(Arrays.asList(now + "0,press,,,", now + "1,press,,,", now + "1,undo,,,", now + "2,press,,,"), rows(recorder, Table.PRESSES));
  }

  @Test public void itWarnsAndLogsTheWarning() throws IOException {
    Recorder recorder = start();
    frame(recorder, TrackingState.TRACKING, 0);
    clocks.pass(3);
    recorder.tick();
    clocks.pass(100);
    recorder.tick();
    recorder.stop();
    assertEquals(Arrays.asList(Warning.TRACKING, Warning.NO_LANDMARK), warned);
    assertEquals(Arrays.asList("started,", "frame_clock,boot", "warning,tracking", "warning,no_landmark", "stopped,"), events(recorder));
  }

  @Test public void clockJumpsLowSpaceAndLowBatteryAreTold() throws IOException {
    Recorder recorder = start();
    clocks.wallSetMs = 3_600_000;
    recorder.tick();
    assertEquals(3_600_000, recorder.status().clockJumpMs);
    clocks.wallSetMs = 0;
    recorder.tick();
    freeBytes = 500L << 20;
    recorder.tick();
    recorder.tick();
    recorder.battery(16);
    recorder.battery(15);
    recorder.battery(14);
    recorder.battery(90);
    recorder.battery(15);
    recorder.stop();
    assertEquals(Arrays.asList("started,", "wall_clock_changed,+3600000", "wall_clock_changed,-3600000", "storage_low,524288000",
        "battery_low,15", "battery_low,15", "stopped,"), events(recorder));
  }

  @Test public void itStopsByItselfWhileThereIsSpaceToSaySo() throws IOException {
    Recorder recorder = start();
    freeBytes = (64L << 20) - 1;
    recorder.tick();
    assertTrue(recorder.isEnded());
    assertEquals(EndState.DISK_FULL, ended.get(0).state);
    assertEquals("disk_full,67108863", events(recorder).get(1));
    assertEquals("disk_full", ((Map<?, ?>) json(recorder).get("end")).get("state"));
    assertEquals("a later stop changes nothing", EndState.DISK_FULL, recorder.stop().state);
    assertEquals(1, ended.size());
  }

  /** The disk of one table takes so many bytes, then fails in these words. */
  private static RowSink.Opener failing(Table table, int limit, String words) {
    return path -> new RowSink() {
      private final FileSink file = new FileSink(path);

      @Override public void write(byte[] bytes, int length) throws IOException {
        boolean limited = path.getName().equals(table.fileName);
        int fits = limited ? (int) Math.min(length, Math.max(0, limit - file.size())) : length;
        file.write(bytes, fits);
        if (fits < length) {
          throw new IOException(words);
        }
      }

      @Override public long size() throws IOException {
        return file.size();
      }

      @Override public void truncate(long size) throws IOException {
        file.truncate(size);
      }

      @Override public void force() throws IOException {
        file.force();
      }

      @Override public void close() throws IOException {
        file.close();
      }
    };
  }

  @Test public void aFullDiskLeavesWholeRowsInAllTablesAndEndsTheSession() throws IOException {
    Recorder recorder = start(failing(Table.SENSORS, 300, "write failed: ENOSPC (No space left on device)"));
    for (int i = 0; i < 20; i++) {
      recorder.sensor(SensorKind.ACC, clocks.bootNs, new float[] {1, 2, 3}, 3);
      frame(recorder, TrackingState.TRACKING, 0);
    }
    recorder.tick();
    assertTrue(recorder.isEnded());
    recorder.sensor(SensorKind.ACC, clocks.bootNs, new float[3], 3);
    recorder.press();
    recorder.tick();
    for (String row : rows(recorder, Table.SENSORS)) {
      assertTrue(row, row.matches("[0-9]{13},ACC,1.0,2.0,3.0,,,,3"));
    }
    assertEquals(20, rows(recorder, Table.CAMERA).size());
    assertEquals("disk_full", ((Map<?, ?>) json(recorder).get("end")).get("state"));
    assertEquals("disk_full,10737418240", events(recorder).get(2));
  }

  @Test public void aStartThatFailsLeavesNothing() {
    try {
      start(failing(Table.WIFI, 0, "No space left on device"));
      fail("started");
    } catch (IOException e) {
      assertEquals("WiFi.csv: No space left on device", e.getMessage());
    }
    assertArrayEquals(new String[0], temporary.getRoot().list());
  }

  @Test public void anotherFailureOfTheDiskNamesTheFile() throws IOException {
    Recorder recorder = start(failing(Table.WIFI, 200, "Input/output error"));
    for (int i = 0; i < 9; i++) {
      recorder.scanDelivered(true, Collections.singletonList(new WifiReading(5, "aa", "", -60, 2412, 20, 0, 0)));
    }
    SessionEnd end = recorder.stop();
    assertEquals(EndState.WRITE_FAILED, end.state);
    assertEquals("WiFi.csv: Input/output error", end.detail);
    assertEquals("write_failed", ((Map<?, ?>) json(recorder).get("end")).get("state"));
  }

  @Test public void aCrashIsSaid() throws IOException {
    Recorder recorder = start();
    recorder.crashed(new IllegalStateException("oh"));
    assertEquals("crashed,java.lang.IllegalStateException: oh", events(recorder).get(1));
    assertEquals("crashed", ((Map<?, ?>) json(recorder).get("end")).get("state"));
  }

  @Test public void afterTheEndNothingIsLogged() throws IOException {
    Recorder recorder = start();
    recorder.stop();
    frame(recorder, TrackingState.TRACKING, 0);
    recorder.sensor(SensorKind.ACC, 1, new float[3], 0);
    recorder.scanDelivered(true, Collections.singletonList(new WifiReading(5, "aa", "", -60, 2412, 20, 0, 0)));
    recorder.ble(new BleReading(1, "aa", null, -60, 0, null));
    recorder.press();
    recorder.event("screen_off", "");
    recorder.tick();
    for (Table table : Table.values()) {
      assertEquals(table == Table.EVENTS ? 2 : 0, rows(recorder, table).size());
    }
    assertNotNull(recorder.status().end);
  }

  @Test public void anotherFloorIsAnEventAndShown() throws IOException {
    Recorder recorder = start();
    assertEquals(4, recorder.status().floor);
    recorder.floor(4);
    recorder.floor(-1);
    recorder.floor(4);
    assertEquals(4, recorder.status().floor);
    recorder.stop();
    recorder.floor(7);
    assertEquals(4, recorder.status().floor);
    assertEquals(Arrays.asList("started,", "floor,-1", "floor,4", "stopped,"), events(recorder));
  }

  @Test public void aMagnetometerThatWantsToBeCalibratedIsToldAndShown() throws IOException {
    Recorder recorder = start();
    recorder.sensor(SensorKind.MAG, clocks.bootNs, new float[] {1, 2, 3}, 3);
    recorder.accuracy(SensorKind.ACC, 0);
    assertFalse(recorder.status().magnetometerLow);
    recorder.accuracy(SensorKind.MAG, 1);
    recorder.sensor(SensorKind.MAG, clocks.bootNs, new float[] {1, 2, 3}, 0);
    assertTrue(recorder.status().magnetometerLow);
    recorder.sensor(SensorKind.MAG, clocks.bootNs, new float[] {1, 2, 3}, 2);
    assertFalse(recorder.status().magnetometerLow);
    recorder.stop();
    assertEquals(Arrays.asList("started,", "magnetometer_accuracy,1", "magnetometer_accuracy,2", "stopped,"), events(recorder));
  }

  @Test public void theMapShowsWhereWifiWasHeardAndBeginsAnewOnAnotherFloor() throws IOException {
    Recorder recorder = start();
    TrackedImage image = new TrackedImage("12", TrackingState.TRACKING, "FULL_TRACKING", new Pose(1, 0, 0, 0, 0, 0, 1), 0.2f, 0.2f);
    TrackedImage known = new TrackedImage("12", TrackingState.TRACKING, "LAST_KNOWN_POSE", new Pose(2, 0, 0, 0, 0, 0, 1), 0.2f, 0.2f);
    frame(recorder, TrackingState.TRACKING, 3, image);
    recorder.scanDelivered(true, Collections.emptyList());
    recorder.scanDelivered(false, Collections.emptyList());
    frame(recorder, TrackingState.TRACKING, 4, known);
    assertEquals(1, recorder.map().scans.size());
    assertEquals(3, recorder.map().scans.get(0).xM, 0);
    assertEquals(2, recorder.map().landmarks.get("12").xM, 0);
    recorder.floor(5);
    frame(recorder, TrackingState.TRACKING, 5, known);
    assertTrue(recorder.map().scans.isEmpty() && recorder.map().landmarks.isEmpty());
    recorder.stop();
  }

  @Test public void eventsHavePlainNames() throws IOException {
    Recorder recorder = start();
    for (String name : new String[] {"", "Screen", "a b", "1a", "ü"}) {
      try {
        recorder.event(name, "");
        fail(name);
      } catch (IllegalArgumentException expected) {
        assertFalse(recorder.isEnded());
      }
    }
    recorder.stop();
  }

  @Test public void theTickerWritesByItself() throws Exception {
    Recorder recorder = start();
    try (Ticker ticker = new Ticker(recorder)) {
      assertNotNull(ticker);
      recorder.press();
      long patience = System.nanoTime() + 10_000_000_000L;
      while (rows(recorder, Table.PRESSES).isEmpty() && System.nanoTime() < patience) {
        Thread.sleep(20);
      }
      assertEquals(1, rows(recorder, Table.PRESSES).size());
    }
    recorder.stop();
  }
}
