package org.vislam2tag.app.recording;

import android.os.SystemClock;
import java.time.ZoneId;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.Clocks;

/** The phone's own clocks. */
public final class PhoneClocks implements Clocks {
  @Override public ClockReading read() {
    return new ClockReading(SystemClock.elapsedRealtimeNanos(), System.nanoTime(), System.currentTimeMillis());
  }

  @Override public ZoneId zone() {
    return ZoneId.systemDefault();
  }
}
