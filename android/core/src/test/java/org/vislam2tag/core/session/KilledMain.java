package org.vislam2tag.core.session;

import java.io.File;
import java.time.ZoneId;
import java.util.Arrays;
import java.util.Collections;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;
import org.vislam2tag.core.record.WifiReading;
import org.vislam2tag.core.table.FileSink;
import org.vislam2tag.core.tracking.AnchorHost;
import org.vislam2tag.core.walk.Warning;

/** Records as fast as it can until it is killed; prints now and then how many presses it had logged a moment ago. */
final class KilledMain {
  private KilledMain() {}

  private static final Clocks CLOCKS = new Clocks() {
    @Override public ClockReading read() {
      long now = System.nanoTime();
      return new ClockReading(now, now, System.currentTimeMillis());
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

    @Override public void ended(SessionEnd end) {}
  };

  public static void main(String[] arguments) throws Exception {
    Recorder recorder = Recorder.start(new Recorder.Setup(CLOCKS, RecorderSettings.usual(), DEAF, FileSink::new, null),
        new SessionDescription.Builder().build(), new File(arguments[0]));
    new Ticker(recorder);
    for (int i = 0; ; i++) {
      told(recorder, i);
      if (i % 100 == 0) {
        System.out.println(i + " " + System.nanoTime());
        Thread.sleep(5);
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
