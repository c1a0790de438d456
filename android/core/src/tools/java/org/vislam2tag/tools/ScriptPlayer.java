package org.vislam2tag.tools;

import java.io.File;
import java.io.IOException;
import java.time.ZoneId;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.record.Beacon;
import org.vislam2tag.core.record.BleReading;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.RttReading;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;
import org.vislam2tag.core.record.WifiReading;
import org.vislam2tag.core.session.Recorder;
import org.vislam2tag.core.session.RecorderListener;
import org.vislam2tag.core.session.RecorderSettings;
import org.vislam2tag.core.session.SensorOn;
import org.vislam2tag.core.session.SessionDescription;
import org.vislam2tag.core.session.SessionEnd;
import org.vislam2tag.core.table.FileSink;
import org.vislam2tag.core.tracking.AnchorHost;
import org.vislam2tag.core.walk.Warning;

/** Plays a script into the app's own recorder, line by line. */
final class ScriptPlayer {
  /** The app ticks this often, ns. */
  private static final long TICK_NS = 500_000_000L;

  /** How a script ends. */
  enum Ending { STOPPED, KILLED }

  private interface Call {
    void on(ScriptLine line) throws IOException;
  }

  private static final RecorderListener DEAF = new RecorderListener() {
    @Override public void warning(Warning warning) {}

    @Override public void caught(String landmark) {}

    @Override public void scansStopped(Radio radio) {}

    @Override public void ended(SessionEnd end) {}
  };

  private final File sessions;
  private final ScriptedClocks clocks = new ScriptedClocks();
  private final ScriptedAnchors anchors = new ScriptedAnchors();
  private final Map<String, Call> calls = new HashMap<>();
  private final Map<String, String> set = new HashMap<>();
  private final List<SensorOn> sensorsOn = new ArrayList<>();
  private final List<TrackedImage> images = new ArrayList<>();
  private final List<WifiReading> readings = new ArrayList<>();
  private Runnable pending;
  private Recorder recorder;
  private long tickedNs;
  private Ending ending;

  /** Plays into a new session in a folder of {@code sessions}. */
  ScriptPlayer(File sessions) {
    this.sessions = sessions;
    calls.put("set", line -> set.put(line.text(), line.textOr("")));
    calls.put("sensor_on", this::sensorOn);
    calls.put("clock", line -> clocks.set(new ClockReading(line.integer(), line.integer(), line.integer())));
    calls.put("start", this::start);
    calls.put("frame", this::frame);
    calls.put("image", this::image);
    calls.put("anchor", line -> anchors.tell((int) line.integer(), new AnchorHost.State(line.oneOf(TrackingState.class), pose(line))));
    calls.put("part", line -> at(line).newPart());
    calls.put("camera", line -> at(line).camera(line.either("available", "unavailable"), line.textOr("")));
    calls.put("sensor", this::sensor);
    calls.put("accuracy", line -> at(line).accuracy(line.oneOf(SensorKind.class), (int) line.integer()));
    calls.put("battery", line -> at(line).battery((int) line.integer()));
    calls.put("throttling", line -> at(line).throttling(line.either("on", "off")));
    calls.put("scan_accepted", line -> at(line).scanAccepted());
    calls.put("scan_refused", line -> at(line).scanRefused());
    calls.put("scan", this::scan);
    calls.put("reading", this::reading);
    calls.put("ble", this::ble);
    calls.put("range", this::range);
    calls.put("press", line -> at(line).press());
    calls.put("tap", line -> at(line).tap(line.number(), line.number(), line.number()));
    calls.put("floor", line -> at(line).floor((int) line.integer()));
    calls.put("undo", line -> at(line).undoPress());
    calls.put("screen", line -> at(line).screen(line.either("on", "off")));
    calls.put("event", line -> at(line).event(line.text(), line.textOr("")));
    calls.put("stop", line -> end(line, Ending.STOPPED));
    calls.put("kill", line -> end(line, Ending.KILLED));
  }

  /** Plays a line. */
  void play(ScriptLine line) throws IOException {
    Call call = calls.get(line.word());
    if (call == null) {
      throw line.wrong("unknown word");
    }
    if (ending != null) {
      throw line.wrong("after the end");
    }
    boolean belongs = line.word().equals("image") || line.word().equals("anchor") || line.word().equals("reading");
    if (belongs && pending == null) {
      throw line.wrong("belongs to no frame or scan");
    }
    if (!belongs) {
      runPending();
    }
    try {
      call.on(line);
    } catch (IllegalArgumentException | ArithmeticException e) {
      throw line.wrong(e.getMessage());
    }
    if (!line.isAtEnd()) {
      throw line.wrong("more fields than expected");
    }
  }

  /** How the script ended; null while it has not. */
  Ending ending() {
    return ending;
  }

  /** The session's folder. */
  File folder() {
    return recorder.folder();
  }

  private void runPending() {
    if (pending != null) {
      Runnable call = pending;
      pending = null;
      call.run();
    }
  }

  /** The recorder, at the time in the line's next field. */
  private Recorder at(ScriptLine line) {
    long now = line.integer();
    if (recorder == null) {
      throw line.wrong("before start");
    }
    if (now < clocks.boot()) {
      throw line.wrong("the boot clock never falls");
    }
    clocks.boot(now);
    if (now - tickedNs >= TICK_NS) {
      tickedNs = now;
      recorder.tick();
    }
    return recorder;
  }

  private void start(ScriptLine line) throws IOException {
    SessionDescription.Builder description = new SessionDescription.Builder();
    description.place(setOr("site", ""), Integer.parseInt(setOr("floor", "0"))).device(setOr("device", "phone"));
    description.note(setOr("note", "")).app(setOr("app_version", ""));
    description.phone(setOr("manufacturer", ""), setOr("model", ""), setOr("android", ""),
        Integer.parseInt(setOr("api", "0")), setOr("arcore", null));
    description.landmarks(Integer.parseInt(setOr("landmarks", "0")));
    sensorsOn.forEach(description::sensor);
    clocks.zone(ZoneId.of(setOr("zone", "UTC")));
    tickedNs = line.integer();
    clocks.boot(tickedNs);
    recorder = Recorder.start(new Recorder.Setup(clocks, RecorderSettings.usual(), DEAF, FileSink::new, () -> Long.MAX_VALUE),
        description.build(), sessions);
  }

  private String setOr(String key, String other) {
    return set.getOrDefault(key, other);
  }

  private void sensorOn(ScriptLine line) {
    SensorKind kind = line.oneOf(SensorKind.class);
    sensorsOn.add(new SensorOn(kind, line.text(), line.text(), line.isAtEnd() ? SensorOn.FASTEST : line.number()));
  }

  private void frame(ScriptLine line) {
    Recorder at = at(line);
    images.clear();
    anchors.frame(line);
    TrackedFrame frame = new TrackedFrame(clocks.read(), line.integer(), line.oneOf(TrackingState.class), line.text(),
        pose(line), images);
    pending = () -> {
      at.frame(frame, anchors);
      anchors.check();
    };
  }

  private void image(ScriptLine line) {
    images.add(new TrackedImage(line.text(), line.oneOf(TrackingState.class), line.text(), pose(line), line.number(), line.number()));
  }

  private static Pose pose(ScriptLine line) {
    return new Pose(line.number(), line.number(), line.number(), line.number(), line.number(), line.number(), line.number());
  }

  private void sensor(ScriptLine line) {
    Recorder at = at(line);
    SensorKind kind = line.oneOf(SensorKind.class);
    long stampNs = line.integer();
    int accuracy = (int) line.integer();
    float[] values = new float[kind.values];
    int n = 0;
    while (!line.isAtEnd() && n < values.length) {
      values[n++] = line.number();
    }
    at.sensor(kind, stampNs, Arrays.copyOf(values, n), accuracy);
  }

  private void scan(ScriptLine line) {
    Recorder at = at(line);
    boolean fresh = line.either("updated", "stale");
    readings.clear();
    pending = () -> at.scanDelivered(fresh, readings);
  }

  private void reading(ScriptLine line) {
    readings.add(new WifiReading(line.integer(), line.text(), line.text(), (int) line.integer(), (int) line.integer(),
        line.integerOr(0), line.integerOr(0), line.integerOr(0)));
  }

  private void ble(ScriptLine line) {
    Recorder at = at(line);
    long timeNs = line.integer();
    String address = line.text();
    String name = line.textOr(null);
    int rssi = (int) line.integer();
    int power = line.integerOr(BleReading.NO_TX_POWER);
    int company = line.integerOr(-1);
    at.ble(new BleReading(timeNs, address, name, rssi, power, Beacon.of(company, Hex.bytes(line.textOr("")))));
  }

  private void range(ScriptLine line) {
    at(line).range(new RttReading(line.integer(), line.text(), line.either("responder", "other"), (int) line.integer(),
        (int) line.integer(), (int) line.integer(), (int) line.integer(), (int) line.integer()));
  }

  private void end(ScriptLine line, Ending how) {
    Recorder at = at(line);
    if (how == Ending.STOPPED) {
      at.stop();
    } else {
      at.tick();
    }
    ending = how;
  }
}
