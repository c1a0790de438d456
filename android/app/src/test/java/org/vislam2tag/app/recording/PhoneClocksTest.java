package org.vislam2tag.app.recording;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;

import java.time.ZoneId;
import org.junit.Test;

public class PhoneClocksTest {
  @Test public void readsTheWallClockAndTheZoneOfThePhone() {
    long before = System.currentTimeMillis();
    long read = new PhoneClocks().read().wallMs;
    assertTrue(read >= before && read <= System.currentTimeMillis());
    assertEquals(ZoneId.systemDefault(), new PhoneClocks().zone());
  }
}
