package org.vislam2tag.core.table;

import static org.junit.Assert.assertEquals;

import java.util.EnumSet;
import java.util.Set;
import org.junit.Test;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.record.AnchorPose;
import org.vislam2tag.core.record.Beacon;
import org.vislam2tag.core.record.BleReading;
import org.vislam2tag.core.record.CameraPose;
import org.vislam2tag.core.record.Event;
import org.vislam2tag.core.record.LandmarkPose;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.Press;
import org.vislam2tag.core.record.RttReading;
import org.vislam2tag.core.record.SensorKind;
import org.vislam2tag.core.record.SensorReading;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;
import org.vislam2tag.core.record.WifiReading;
import org.vislam2tag.core.record.WifiRow;

/** The rows of docs/reference/phone-tables.md, as it shows them. */
public class RecordsTest {
  private static final Pose POSE = new Pose(0.012f, -0.003f, 0.101f, 0.01f, 0.02f, 0, 0.99975f);
  private static final ClockReading ARRIVAL = new ClockReading(84210371200456L, 61110371200400L, 0);

  private static String line(Record record) {
    Row row = new Row();
    record.write(row);
    assertEquals(record.table().header.split(",").length, row.fields());
    return row.line().trim();
  }

  @Test public void cameraFrames() {
    assertEquals("84210333500123,84210371200456,84210333500123,61110371200400,boot,0,TRACKING,NONE,"
        + "0.012,-0.003,0.101,0.01,0.02,0.0,0.99975",
        line(new CameraPose(ARRIVAL, 84210333500123L, 0, TrackingState.TRACKING, "NONE", POSE)));
  }

  @Test public void landmarks() {
    TrackedImage seen = new TrackedImage("12", TrackingState.TRACKING, "FULL_TRACKING",
        new Pose(1.52f, 0.31f, -2.204f, 0.5f, -0.5f, -0.5f, 0.5f), 0.2f, 0.2f);
    assertEquals("84210333500123,12,TRACKING,FULL_TRACKING,1.52,0.31,-2.204,0.5,-0.5,-0.5,0.5,0.2,0.2",
        line(new LandmarkPose(84210333500123L, seen)));
    TrackedImage unsized = new TrackedImage("a,\"b\"", TrackingState.PAUSED, "LAST_KNOWN_POSE", POSE, 0, 0);
    assertEquals("7,\"a,\"\"b\"\"\",PAUSED,LAST_KNOWN_POSE,0.012,-0.003,0.101,0.01,0.02,0.0,0.99975,,",
        line(new LandmarkPose(7, unsized)));
  }

  @Test public void anchors() {
    assertEquals("7,3,PAUSED,0.012,-0.003,0.101,0.01,0.02,0.0,0.99975", line(new AnchorPose(7, 3, TrackingState.PAUSED, POSE)));
  }

  @Test public void sensors() {
    float[] acc = {0.12f, 9.78f, 0.35f};
    assertEquals("84210333500123,ACC,0.12,9.78,0.35,,,,3", line(new SensorReading(84210333500123L, SensorKind.ACC, acc, 3)));
    float[] un = {0.01f, -0.02f, 0, 0.001f, 0, -0.001f};
    assertEquals("84210334100123,GYRO_UN,0.01,-0.02,0.0,0.001,0.0,-0.001,3",
        line(new SensorReading(84210334100123L, SensorKind.GYRO_UN, un, 3)));
    float[] long1 = {1009.31f, 7, 7};
    assertEquals("1,PRESSURE,1009.31,,,,,,-1", line(new SensorReading(1, SensorKind.PRESSURE, long1, -1)));
    assertEquals("1,ROT,0.0,,,,,,0", line(new SensorReading(1, SensorKind.ROT, new float[] {0, Float.NaN}, 0)));
  }

  @Test public void wifi() {
    WifiReading one = new WifiReading(84211002345L, "02:11:22:AA:44:55", "eduroam", -61, 5180, 80, 5210, 0);
    assertEquals("84211002345000,3,02:11:22:aa:44:55,eduroam,-61,5180,80,5210,,84211100000000,fresh,off",
        line(new WifiRow(one, 3, 84211100000000L, true, "off")));
    WifiReading two = new WifiReading(84210990000L, "02:11:22:33:44:56", "say \"hi\", twice", -77, 2437, 20, 0, 0);
    assertEquals("84210990000000,3,02:11:22:33:44:56,\"say \"\"hi\"\", twice\",-77,2437,20,,,84211100000000,cached,",
        line(new WifiRow(two, 3, 84211100000000L, false, null)));
  }

  @Test public void channelWidthsOfAndroid() {
    int[] widths = {0, 20, 40, 80, 160, 160, 320, 0};
    for (int i = 0; i < widths.length; i++) {
      assertEquals(widths[i], WifiReading.widthMhz(i - 1));
    }
  }

  @Test public void ble() {
    byte[] data = new byte[23];
    data[0] = 2;
    data[1] = 0x15;
    for (int i = 2; i < 23; i++) {
      data[i] = (byte) (0xEE + i);
    }
    assertEquals("5,aa:bb,name,-70,-59,f0f1f2f3-f4f5-f6f7-f8f9-fafbfcfdfeff,1,515",
        line(new BleReading(5, "AA:BB", "name", -70, -59, Beacon.of(0x4C, data))));
    assertEquals("5,aa:bb,,127,,,,", line(new BleReading(5, "AA:BB", null, 127, BleReading.NO_TX_POWER, Beacon.of(0x4D, data))));
    assertEquals(null, Beacon.of(0x4C, new byte[22]));
    assertEquals(null, Beacon.of(0x4C, null));
  }

  @Test public void ranges() {
    assertEquals("84211150000000,aa:bb,1,4.31,0.52,-55,8,7", line(new RttReading(84211150, "AA:BB", true, 4310, 520, -55, 8, 7)));
    assertEquals("84211150000000,aa:bb,0,-0.12,0.0,-61,8,1", line(new RttReading(84211150, "aa:bb", false, -120, 0, -61, 8, 1)));
  }

  @Test public void pressesAndEvents() {
    assertEquals("9,0,press,,,", line(Press.button(9, 0)));
    assertEquals("9,1,tap,12.5,-3.0,0.6", line(Press.tap(9, 1, 12.5f, -3, 0.6f)));
    assertEquals("10,1,undo,,,", line(Press.tap(9, 1, 12.5f, -3, 0.6f).undone(10)));
    assertEquals("9,camera_unavailable,\"a, b\"", line(new Event(9, "camera_unavailable", "a, b")));
    assertEquals("9,started,", line(new Event(9, "started", "")));
  }

  @Test public void noTableIsForgottenHere() {
    Set<Table> written = EnumSet.of(Table.CAMERA, Table.LANDMARKS, Table.ANCHORS, Table.SENSORS, Table.WIFI, Table.BLE,
        Table.RTT, Table.PRESSES, Table.EVENTS);
    assertEquals(EnumSet.allOf(Table.class), written);
  }
}
