package org.vislam2tag.tools;

import static org.junit.Assert.assertArrayEquals;
import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;

import java.io.File;
import java.io.IOException;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.Random;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.TestClocks;
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

/** What a recorder was told, written as a script and played again, makes the same session, byte for byte. */
public class RecordedScriptTest {
  private static final long TICK_NS = 500_000_000L;
  private static final RecorderListener DEAF = new RecorderListener() {
    @Override public void warning(Warning warning) {}

    @Override public void caught(String landmark) {}

    @Override public void scansStopped(Radio radio) {}

    @Override public void ended(SessionEnd end) {}
  };

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();
  private final TestClocks clocks = new TestClocks();
  private final Random random = new Random(7);
  private final List<Pose> anchors = new ArrayList<>();
  private final AnchorHost host = new AnchorHost() {
    @Override public boolean set(int number, Pose pose) {
      anchors.add(pose);
      return true;
    }

    @Override public State get(int number) {
      return new State(TrackingState.TRACKING, anchors.get(number));
    }

    @Override public void detach(int number) {}
  };
  private Recorder recorder;
  private long tickedNs = TestClocks.START_NS;

  private interface Call {
    void now() throws IOException;
  }

  /** As the app: it ticks every half second. */
  private void after(double seconds, Call call) throws IOException {
    clocks.pass(seconds);
    if (clocks.bootNs - tickedNs >= TICK_NS) {
      tickedNs = clocks.bootNs;
      recorder.tick();
    }
    call.now();
  }

  private Recorder start(File sessions, File scripts) throws IOException {
    SessionDescription description = new SessionDescription.Builder().place("Main \\ \"building\"", -1).device("LG")
        .note("tab\there,\nand a line").app("1.0.0").phone("LGE", "LM-G900", "11", 30, null)
        .sensor(new SensorOn(SensorKind.ACC, "LSM6DSO", "STMicro", 200)).sensor(new SensorOn(SensorKind.MAG, "AK", "", SensorOn.FASTEST))
        .landmarks(24).build();
    return Recorder.start(new Recorder.Setup(clocks, RecorderSettings.usual(), DEAF, FileSink::new, () -> Long.MAX_VALUE)
        .withScripts(scripts), description, sessions);
  }

  private TrackedFrame frame(float x, TrackingState state) {
    TrackedImage image = new TrackedImage("a, \"b\"", TrackingState.TRACKING, "FULL_TRACKING", pose(x), 0.2f, 0);
    return new TrackedFrame(clocks.read(), clocks.bootNs - 30_000_000, state, state == TrackingState.TRACKING ? "NONE" : "BAD_STATE",
        pose(x), x > 3 && x < 4 ? Collections.singletonList(image) : Collections.emptyList());
  }

  private Pose pose(float x) {
    return new Pose(x, random.nextFloat(), -x / 3, random.nextFloat(), 0.1f, 0.2f, 0.9f);
  }

  private void walk() throws IOException {
    for (int i = 0; i < 400; i++) {
      float x = i * 0.05f;
      TrackingState state = i > 250 && i < 290 ? TrackingState.PAUSED : TrackingState.TRACKING;
      after(0.033, () -> recorder.frame(frame(x, state), host));
      after(0.002, () -> recorder.sensor(SensorKind.ACC, clocks.bootNs - 9, new float[] {x, Float.NaN, 9.8f, 7, 7, 7, 7}, 3));
    }
  }

  private void everythingElse() throws IOException {
    byte[] beacon = new byte[23];
    beacon[0] = 2;
    beacon[1] = 0x15;
    beacon[7] = (byte) 0xAB;
    beacon[19] = 9;
    after(0.1, () -> recorder.throttling(true));
    after(0.1, () -> recorder.scanAccepted());
    after(3, () -> recorder.scanDelivered(true, Arrays.asList(new WifiReading(5, "AA:bb", "x\ty\n\\", -60, 2412, 20, 0, 0),
        new WifiReading(6, "cc", null, -71, 5180, 160, 5250, 5330))));
    after(0.1, () -> recorder.scanRefused());
    after(0.1, () -> recorder.scanDelivered(false, Collections.emptyList()));
    after(0.1, () -> recorder.ble(new BleReading(7, "DD", "n", -60, -4, Beacon.of(Beacon.COMPANY, beacon))));
    after(0.1, () -> recorder.ble(new BleReading(8, "DD", null, -60, BleReading.NO_TX_POWER, null)));
    after(0.1, () -> recorder.range(new RttReading(84_211_150, "EE", true, -120, 310, -61, 8, 5)));
    after(0.1, () -> recorder.press());
    after(0.1, () -> recorder.tap(1.25f, -3, 0.6f));
    after(0.1, () -> recorder.undoPress());
    after(0.1, () -> recorder.floor(2));
    after(0.1, () -> recorder.accuracy(SensorKind.MAG, 0));
    after(0.1, () -> recorder.sensor(SensorKind.MAG, 77, new float[] {1, 2, 3}, 3));
    after(0.1, () -> recorder.battery(9));
    after(0.1, () -> recorder.screen(false));
    after(95, () -> recorder.screen(true));
    after(0.1, () -> recorder.event("phone_call", "says \"hi\""));
    clocks.wallSetMs += 3_600_000;
    after(0.1, () -> recorder.camera(false, "camera in use"));
    after(0.1, () -> recorder.newPart());
    after(0.1, () -> recorder.camera(true, ""));
  }

  @Test public void playedAgainItIsTheSameSession() throws IOException {
    File scripts = temporary.newFolder();
    recorder = start(temporary.newFolder(), scripts);
    walk();
    everythingElse();
    walk();
    after(0.6, recorder::stop);
    ScriptPlayer again = ReplayMain.play(new File(scripts, recorder.folder().getName() + ".txt"), temporary.newFolder());
    assertEquals(recorder.folder().getName(), again.folder().getName());
    String[] files = recorder.folder().list();
    Arrays.sort(files);
    assertTrue(files.length > 9);
    for (String file : files) {
      assertArrayEquals(file, Files.readAllBytes(new File(recorder.folder(), file).toPath()),
          Files.readAllBytes(new File(again.folder(), file).toPath()));
    }
    assertTrue(new String(Files.readAllBytes(new File(again.folder(), "Events.csv").toPath())).contains("scans_stopped"));
  }

  @Test public void aScriptThatCannotBeWrittenKeepsNoSessionFromBeingRecorded() throws IOException {
    recorder = start(temporary.newFolder(), new File(temporary.getRoot(), "not there"));
    after(1, () -> recorder.press());
    recorder.stop();
    assertEquals(2, Files.readAllLines(new File(recorder.folder(), "ControlPoint.csv").toPath()).size());
  }
}
