package org.vislam2tag.app.sensing;

import android.hardware.Sensor;
import android.hardware.SensorEvent;
import android.hardware.SensorEventListener;
import android.hardware.SensorManager;
import android.os.Handler;
import android.os.HandlerThread;
import java.util.EnumMap;
import java.util.HashMap;
import java.util.Map;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.session.Recorder;
import org.vislam2tag.core.session.SensorOn;
import org.vislam2tag.core.session.SessionDescription;

/** All sensors of the format that the phone has, on a thread of their own. */
public final class SensorLog implements SensorEventListener, Feed {
  private static final int MICROS = 1_000_000;

  private final SensorManager manager;
  private final double rateHz;
  private final Map<SensorKind, Sensor> sensors = new EnumMap<>(SensorKind.class);
  private final Map<Integer, SensorKind> kinds = new HashMap<>();
  private Recorder recorder;
  private HandlerThread thread;

  /** At a rate in Hz, or {@link SensorOn#FASTEST}. */
  public SensorLog(SensorManager manager, double rateHz) {
    this.manager = manager;
    this.rateHz = rateHz;
    for (SensorKind kind : SensorKind.values()) {
      Sensor sensor = manager.getDefaultSensor(kind.androidType);
      kinds.put(kind.androidType, kind);
      if (sensor != null) {
        sensors.put(kind, sensor);
      }
    }
  }

  /** Tells session.json which sensors there are. */
  public void describe(SessionDescription.Builder description) {
    for (Map.Entry<SensorKind, Sensor> entry : sensors.entrySet()) {
      Sensor sensor = entry.getValue();
      description.sensor(new SensorOn(entry.getKey(), sensor.getName(), sensor.getVendor(), rateHz));
    }
  }

  /** Starts logging; sensors that the phone lacks are events. */
  @Override public void start(Recorder into) {
    recorder = into;
    thread = new HandlerThread("sensors");
    thread.start();
    Handler handler = new Handler(thread.getLooper());
    for (SensorKind kind : SensorKind.values()) {
      Sensor sensor = sensors.get(kind);
      if (sensor == null || !manager.registerListener(this, sensor, periodUs(), handler)) {
        into.event("sensor_missing", kind.name());
      }
    }
  }

  /** Ends logging; nothing happens where it was not started. */
  @Override public void stop() {
    manager.unregisterListener(this);
    if (thread != null) {
      thread.quitSafely();
      thread = null;
    }
  }

  @Override public void onSensorChanged(SensorEvent event) {
    recorder.sensor(kinds.get(event.sensor.getType()), event.timestamp, event.values, event.accuracy);
  }

  @Override public void onAccuracyChanged(Sensor sensor, int accuracy) {
    recorder.accuracy(kinds.get(sensor.getType()), accuracy);
  }

  /** Microseconds between readings; 0 asks for the fastest. */
  int periodUs() {
    return Double.isNaN(rateHz) ? SensorManager.SENSOR_DELAY_FASTEST : (int) Math.round(MICROS / rateHz);
  }
}
