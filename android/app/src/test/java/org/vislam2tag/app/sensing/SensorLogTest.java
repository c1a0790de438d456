package org.vislam2tag.app.sensing;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;
import static org.mockito.ArgumentMatchers.any;
import static org.mockito.ArgumentMatchers.anyInt;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.when;

import android.hardware.Sensor;
import android.hardware.SensorManager;
import java.util.List;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.Recorded;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.session.SensorOn;

public class SensorLogTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final SensorManager manager = mock(SensorManager.class);

  @Test public void sensorsThatAreNotThereAreEvents() throws Exception {
    Sensor gyroscope = mock(Sensor.class);
    when(manager.getDefaultSensor(SensorKind.GYRO.androidType)).thenReturn(gyroscope);
    when(manager.registerListener(any(), any(Sensor.class), anyInt(), any())).thenReturn(true);
    Recorded recorded = new Recorded(folder.getRoot());
    SensorLog log = new SensorLog(manager, 100);
    log.start(recorded.recorder);
    log.stop();
    List<String> events = recorded.events();
    assertEquals(SensorKind.values().length - 1, events.size());
    assertTrue(events.contains("sensor_missing,PRESSURE"));
    assertTrue(!events.contains("sensor_missing,GYRO"));
  }

  @Test public void aMagnetometerThatIsNotAccurateIsAnEvent() throws Exception {
    Sensor magnetometer = mock(Sensor.class);
    when(magnetometer.getType()).thenReturn(SensorKind.MAG.androidType);
    Recorded recorded = new Recorded(folder.getRoot());
    SensorLog log = new SensorLog(manager, 100);
    log.start(recorded.recorder);
    log.onAccuracyChanged(magnetometer, 1);
    log.stop();
    assertTrue(recorded.events().contains("magnetometer_accuracy,1"));
  }

  @Test public void aRateBecomesAPeriod() {
    assertEquals(10_000, new SensorLog(manager, 100).periodUs());
    assertEquals(0, new SensorLog(manager, SensorOn.FASTEST).periodUs());
  }
}
