package org.vislam2tag.core.session;

import java.io.File;
import java.time.ZoneId;
import java.util.Arrays;
import java.util.Collections;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;
import org.vislam2tag.core.record.WifiReading;
import org.vislam2tag.core.table.FileSink;
import org.vislam2tag.core.tracking.AnchorHost;
import org.vislam2tag.core.walk.Warning;

/** Records as fast as it can, ten milliseconds of its own clock a row, until it is killed; prints which rows were written. */
final class KilledMain {
  private static long nowNs = 1_000_000_000L;

  private KilledMain() {}

  private static final long ROW_NS = 10_000_000L;
  /** As the ticker does it, twice a second. */
  private static final int ROWS_A_TICK = 50;

  private static final Clocks CLOCKS = new Clocks() {
    @Override public ClockReading read() {
      return new ClockReading(nowNs, nowNs, nowNs / 1_000_000);
    }

    @Override public ZoneId zone() {
      return ZoneId.of("UTC");
    }
  };

  private static final AnchorHost ANCHORS = new AnchorHost() {
    @Override public boolean set(int number, Pose pose) {
      return true;
    }

    @Override public State get(int number) {
      return new State(TrackingState.TRACKING, new Pose(0, 0, 0, 0, 0, 0, 1));
    }

    @Override public void detach(int number) {}
  };

  private static final RecorderListener DEAF = new RecorderListener() {
    @Override public void warning(Warning warning) {}

    @Override public void caught(String landmark) {}

    @Override public void scansStopped(Radio radio) {}

    @Override public void ended(SessionEnd end) {}
  };

  public static void main(String[] arguments) throws Exception {
    Recorder recorder = Recorder.start(new Recorder.Setup(CLOCKS, RecorderSettings.usual(), DEAF, FileSink::new, null),
        new SessionDescription.Builder().build(), new File(arguments[0]));
    for (int i = 0; ; i++) {
      nowNs += ROW_NS;
      told(recorder, i);
      if (i % ROWS_A_TICK == 0) {
        recorder.tick();
        System.out.println(i);
      }
    }
  }

  private static void told(Recorder recorder, int i) {
    Pose pose = new Pose(i, 1, 2, 0, 0, 0, 1);
    ClockReading now = CLOCKS.read();
    TrackedImage image = new TrackedImage("a,\"" + i, TrackingState.TRACKING, "FULL_TRACKING", pose, 0, 0);
    recorder.frame(new TrackedFrame(now, now.bootNs - 1, TrackingState.TRACKING, "NONE", pose, Arrays.asList(image)), ANCHORS);
    recorder.sensor(SensorKind.ACC, now.bootNs, new float[] {1, 2, 3}, 3);
    recorder.scanDelivered(true, Collections.singletonList(new WifiReading(i, "aa:bb", "x\ny", -60, 2412, 20, 0, 0)));
    recorder.press();
    recorder.event("screen_on", "");
  }
}
