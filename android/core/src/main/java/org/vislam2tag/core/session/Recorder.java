package org.vislam2tag.core.session;

import java.io.File;
import java.io.IOException;
import java.util.ArrayList;
import java.util.EnumMap;
import java.util.List;
import java.util.Map;
import java.util.regex.Pattern;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.clock.SensorClock;
import org.vislam2tag.core.clock.WallClockWatch;
import org.vislam2tag.core.record.BleReading;
import org.vislam2tag.core.record.Event;
import org.vislam2tag.core.record.Press;
import org.vislam2tag.core.record.RttReading;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.record.SensorReading;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.WifiReading;
import org.vislam2tag.core.record.WifiRow;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.radio.ScanLog;
import org.vislam2tag.core.radio.SilenceWatch;
import org.vislam2tag.core.table.RowSink;
import org.vislam2tag.core.table.Table;
import org.vislam2tag.core.tracking.AnchorHost;
import org.vislam2tag.core.walk.MagnetometerWatch;
import org.vislam2tag.core.walk.PressCount;
import org.vislam2tag.core.walk.Walk;
import org.vislam2tag.core.walk.WalkMap;
import org.vislam2tag.core.walk.Warning;

/**
 * A session being recorded. What the platform tells goes in through the methods below, from any thread and in any order;
 * they are quick, touch no disk, and do nothing once the session has ended. {@link #tick} must be called about twice a
 * second ({@link Ticker}): it writes.
 */
public final class Recorder {
  private static final Pattern EVENT_NAME = Pattern.compile("[a-z][a-z0-9_]*");

  private final Clocks clocks;
  private final RecorderSettings settings;
  private final RecorderListener listener;
  private final FreeSpace space;
  private final ClockReading start;
  private final OpenSession files;
  private final SessionTables tables;
  private final FrameLog frames;
  private final ScriptLog script;
  private final WallClockWatch wallClock;
  private final LowLevel storage;
  private final LowLevel battery;
  private final Walk walk;
  private final Map<SensorKind, SensorClock> sensorClocks = new EnumMap<>(SensorKind.class);
  private final ScanLog scans = new ScanLog();
  private final Map<Radio, SilenceWatch> silence = new EnumMap<>(Radio.class);
  private final PressCount presses = new PressCount();
  private final MagnetometerWatch magnetometer = new MagnetometerWatch();
  private long clockJumpMs;
  private int floor;
  private SessionEnd end;

  private Recorder(Setup setup, SessionDescription description, File sessions) throws IOException {
    clocks = setup.clocks;
    settings = setup.settings;
    listener = setup.listener;
    space = setup.space == null ? sessions::getUsableSpace : setup.space;
    start = clocks.read();
    files = new OpenSession(sessions, description, start, clocks.zone(), setup.opener, space);
    tables = files.tables();
    script = setup.scripts == null ? null : new ScriptLog(new File(setup.scripts, files.folder().getName() + ".txt"));
    if (script != null) {
      script.begin(description, start, clocks.zone());
    }
    frames = new FrameLog(tables::add);
    wallClock = new WallClockWatch(start);
    storage = new LowLevel(settings.lowBytes);
    battery = new LowLevel(settings.lowBatteryPercent);
    floor = description.floor();
    walk = new Walk(settings.warnings, start.bootNs, description.hasLandmarks());
    for (Radio radio : Radio.values()) {
      silence.put(radio, new SilenceWatch());
    }
    tables.add(new Event(start.bootNs, "started", ""));
  }

  /** What a recorder works with; a test replaces what it wants to see fail. */
  public static final class Setup {
    final Clocks clocks;
    final RecorderSettings settings;
    final RecorderListener listener;
    final RowSink.Opener opener;
    final FreeSpace space;
    File scripts;

    /** {@code space} null: as the folder's disk tells. */
    public Setup(Clocks clocks, RecorderSettings settings, RecorderListener listener, RowSink.Opener opener, FreeSpace space) {
      this.clocks = clocks;
      this.settings = settings;
      this.listener = listener;
      this.opener = opener;
      this.space = space;
    }

    /** For developers: all that is told is also written as a script, into this folder. */
    public Setup withScripts(File folder) {
      scripts = folder;
      return this;
    }
  }

  /**
   * Starts a session in a new folder of {@code sessions}.
   *
   * @throws IOException if its files cannot be made
   */
  public static Recorder start(Setup setup, SessionDescription description, File sessions) throws IOException {
    return new Recorder(setup, description, sessions);
  }

  /** The session's folder. */
  public File folder() {
    return files.folder();
  }

  /** A camera frame; {@code host} sets and answers anchors of the tracker that it is from. */
  public synchronized void frame(TrackedFrame frame, AnchorHost host) {
    if (end != null) {
      return;
    }
    if (script != null) {
      script.frame(frame);
    }
    FrameLog.Logged logged = frames.log(frame, script == null ? host : script.telling(host));
    if (logged != null) {
      walk.frame(frame, logged.timeNs, logged.images, logged.beginsPart);
    }
  }

  /** The tracker began anew: the next frame is in a frame of reference of its own. */
  public synchronized void newPart() {
    tell("part");
    frames.newPart();
  }

  /** Frames come again, or come no more, for {@code reason}. */
  public synchronized void camera(boolean available, String reason) {
    tell("camera", available ? "available" : "unavailable", reason);
    note(available ? "camera_available" : "camera_unavailable", reason);
    if (!available) {
      walk.broke();
    }
  }

  /** A reading of a sensor: {@code stampNs} on the sensor's clock, values in Android's order, accuracy -1 to 3. */
  public synchronized void sensor(SensorKind kind, long stampNs, float[] values, int accuracy) {
    if (end != null) {
      return;
    }
    ClockReading now = clocks.read();
    tellSensor(now, kind, stampNs, values, accuracy);
    SensorClock clock = sensorClocks.get(kind);
    if (clock == null) {
      clock = new SensorClock(stampNs, now);
      sensorClocks.put(kind, clock);
      if (clock.remark() != null) {
        note("sensor_clock", kind + " " + clock.remark());
      }
    }
    tables.add(new SensorReading(clock.bootNs(stampNs, now.bootNs), kind, values, accuracy));
    judge(kind, accuracy);
  }

  private void tellSensor(ClockReading now, SensorKind kind, long stampNs, float[] values, int accuracy) {
    if (script != null) {
      int known = Math.min(kind.values, values.length);
      Object[] fields = new Object[3 + known];
      fields[0] = kind;
      fields[1] = stampNs;
      fields[2] = accuracy;
      for (int i = 0; i < known; i++) {
        fields[3 + i] = values[i];
      }
      script.call(now, "sensor", fields);
    }
  }

  /** The platform tells how accurate a sensor is now, -1 to 3; of the magnetometer a change between low and good is logged. */
  public synchronized void accuracy(SensorKind kind, int accuracy) {
    tell("accuracy", kind, accuracy);
    judge(kind, accuracy);
  }

  private void judge(SensorKind kind, int accuracy) {
    if (end == null && kind == SensorKind.MAG && magnetometer.changes(accuracy)) {
      note("magnetometer_accuracy", Integer.toString(accuracy));
    }
  }

  /** Wi-Fi results are delivered: {@code fresh} if the platform says that the scan succeeded. */
  public synchronized void scanDelivered(boolean fresh, List<WifiReading> readings) {
    if (end != null) {
      return;
    }
    tell("scan", fresh ? "updated" : "stale");
    if (script != null) {
      readings.forEach(reading -> script.line("reading", reading.told()));
    }
    for (WifiRow row : scans.delivered(nowNs(), fresh, readings)) {
      tables.add(row);
    }
    if (fresh) {
      walk.map().scan();
      heard(Radio.WIFI);
    } else {
      note("scan_failed", "");
    }
  }

  /** A Wi-Fi scan was asked for, and begins. */
  public synchronized void scanAccepted() {
    tell("scan_accepted");
    silence.get(Radio.WIFI).expect();
  }

  /** A Wi-Fi scan was asked for and refused. */
  public synchronized void scanRefused() {
    tell("scan_refused");
    scans.refused();
    silence.get(Radio.WIFI).expect();
    note("scan_refused", "");
  }

  /** The platform tells whether it throttles Wi-Fi scans. */
  public synchronized void throttling(boolean on) {
    tell("throttling", on ? "on" : "off");
    if (scans.throttling(on)) {
      note("scan_throttling", scans.throttling());
    }
  }

  /** A Bluetooth LE advertisement. */
  public synchronized void ble(BleReading reading) {
    tell("ble", reading.told());
    if (end == null) {
      tables.add(reading);
      heard(Radio.BLE);
      silence.get(Radio.BLE).expect(); // where one was heard, others will be
    }
  }

  /** A range to an access point. */
  public synchronized void range(RttReading reading) {
    tell("range", reading.told());
    if (end == null) {
      tables.add(reading);
    }
  }

  /** The control-point button is touched now. */
  public synchronized void press() {
    tell("press");
    if (end == null) {
      tables.add(presses.press(nowNs()));
      walk.map().press();
    }
  }

  /** The plan is tapped now, where the walker is: metres in the floor's frame, with the sigma of each. */
  public synchronized void tap(float xM, float yM, float sigmaM) {
    tell("tap", xM, yM, sigmaM);
    if (end == null) {
      tables.add(presses.tap(nowNs(), xM, yM, sigmaM));
    }
  }

  /** The latest press or tap does not count; nothing happens where none does. */
  public synchronized void undoPress() {
    tell("undo");
    Press latest = end == null ? presses.latest() : null;
    if (latest == null) {
      return;
    }
    tables.add(presses.undo(nowNs()));
    if (!latest.isTap()) {
      walk.map().undoPress();
    }
  }

  /** The collector says that they are on another floor now; nothing happens where it is the one they are on. */
  public synchronized void floor(int number) {
    tell("floor", number);
    if (end == null && number != floor) {
      floor = number;
      walk.map().newPart();
      note("floor", Integer.toString(number));
    }
  }

  /** The screen went on or off. */
  public synchronized void screen(boolean on) {
    tell("screen", on ? "on" : "off");
    note(on ? "screen_on" : "screen_off", "");
    silence.values().forEach(watch -> watch.screen(on, nowNs()));
  }

  /** The battery's charge, percent. */
  public synchronized void battery(int percent) {
    tell("battery", percent);
    if (battery.falls(percent)) {
      note("battery_low", Integer.toString(percent));
    }
  }

  /** Something else happened; names and details are those of docs/reference/phone-format.md. */
  public synchronized void event(String name, String detail) {
    if (!EVENT_NAME.matcher(name).matches()) {
      throw new IllegalArgumentException("event \"" + name + "\": small letters, digits, '_'");
    }
    tell("event", name, detail);
    note(name, detail);
  }

  private void note(String name, String detail) {
    if (end == null) {
      tables.add(new Event(nowNs(), name, detail));
    }
  }

  /** What the platform called, for the script. */
  private void tell(String word, Object... fields) {
    if (script != null && end == null) {
      script.call(clocks.read(), word, fields);
    }
  }

  /** Writes what was told so far, watches clock, space and walk; ends the session when the disk takes no more. */
  public void tick() {
    if (isEnded()) {
      return;
    }
    long left = space.bytes();
    SessionEnd failure = files.write(nowNs());
    if (failure == null && left < settings.stopBytes) {
      failure = new SessionEnd(EndState.DISK_FULL, Long.toString(left));
    }
    if (failure != null) {
      end(failure);
      return;
    }
    for (Warning warning : watch(left)) {
      listener.warning(warning);
    }
    for (String landmark : caught()) {
      listener.caught(landmark);
    }
    for (Radio radio : fellSilent()) {
      listener.scansStopped(radio);
    }
  }

  private synchronized List<Radio> fellSilent() {
    List<Radio> news = new ArrayList<>();
    silence.forEach((radio, watch) -> {
      if (watch.fellSilent(nowNs())) {
        news.add(radio);
        note("scans_stopped", radio.word);
      }
    });
    return news;
  }

  private void heard(Radio radio) {
    double silentS = silence.get(radio).heard(nowNs());
    if (silentS > 0) {
      note("scans_resumed", radio.word + " " + Math.round(silentS));
    }
  }

  private Map<Radio, Double> silentS(long nowNs) {
    Map<Radio, Double> seconds = new EnumMap<>(Radio.class);
    silence.forEach((radio, watch) -> seconds.put(radio, watch.silentS(nowNs)));
    return seconds;
  }

  private synchronized List<String> caught() {
    return walk.takeCaught();
  }

  /**
   * The collector stops; tells how the session ended, also if it had ended before. Waits for the disk, as {@link #tick} and
   * {@link #crashed} do: not for the screen's thread.
   */
  public SessionEnd stop() {
    return end(new SessionEnd(EndState.STOPPED, ""));
  }

  /** The app is dying of {@code cause}: saves what can be saved. */
  public SessionEnd crashed(Throwable cause) {
    return end(new SessionEnd(EndState.CRASHED, String.valueOf(cause)));
  }

  /** Has the session ended? */
  public synchronized boolean isEnded() {
    return end != null;
  }

  /** What the screen shows now. */
  public synchronized RecorderStatus status() {
    long nowNs = nowNs();
    return new RecorderStatus((nowNs - start.bootNs) / 1e9, walk.status(nowNs), frames.part(), scans, silentS(nowNs),
        tables.rows(Table.BLE), presses.counting(), clockJumpMs, floor, magnetometer.isLow(), end);
  }

  /** The taps on the plan that count. */
  public synchronized List<Press> taps() {
    return presses.taps();
  }

  /** The walk so far, for drawing. */
  public synchronized WalkMap.Drawing map() {
    return walk.map().drawing();
  }

  private long nowNs() {
    return clocks.read().bootNs;
  }

  private synchronized Iterable<Warning> watch(long bytesLeft) {
    ClockReading now = clocks.read();
    long jumpMs = wallClock.jumpMs(now);
    if (jumpMs != 0) {
      clockJumpMs = jumpMs;
      note("wall_clock_changed", (jumpMs > 0 ? "+" : "") + jumpMs);
    }
    if (storage.falls(bytesLeft)) {
      note("storage_low", Long.toString(bytesLeft));
    }
    for (Table table : Table.values()) {
      long dropped = tables.takeDropped(table);
      if (dropped > 0) {
        note("rows_dropped", table.fileName + " " + dropped);
      }
    }
    Iterable<Warning> news = walk.warnings(now.bootNs);
    for (Warning warning : news) {
      note("warning", warning.word);
    }
    return news;
  }

  private SessionEnd end(SessionEnd planned) {
    ClockReading now = clocks.read();
    synchronized (this) {
      if (end != null) {
        return end;
      }
      if (script != null) {
        script.end(now);
      }
      frames.finish(now.bootNs);
      note(planned.state.word(), planned.detail);
      end = planned;
    }
    SessionEnd known = files.close(planned, now);
    synchronized (this) {
      end = known;
    }
    listener.ended(known);
    return known;
  }
}
