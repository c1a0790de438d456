package org.vislam2tag.app.sensing;

import static org.junit.Assert.assertEquals;
import static org.mockito.ArgumentMatchers.anyInt;
import static org.mockito.ArgumentMatchers.eq;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.when;

import android.content.Context;
import android.os.Handler;
import android.content.Intent;
import android.location.LocationManager;
import android.media.AudioManager;
import android.net.wifi.WifiManager;
import android.os.BatteryManager;
import android.os.Handler;
import java.util.Arrays;
import java.util.Collections;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.Recorded;

public class SurroundingsTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final LocationManager location = mock(LocationManager.class);
  private Recorded recorded;
  private Surroundings surroundings;

  @Before public void start() throws Exception {
    recorded = new Recorded(folder.getRoot());
    when(location.isProviderEnabled(LocationManager.GPS_PROVIDER)).thenReturn(true);
    surroundings = new Surroundings(mock(Context.class), new BleLog(null, mock(Handler.class)), location);
    surroundings.start(recorded.recorder);
  }

  @Test public void wifiGoingOffAndOnIsTold() throws Exception {
    tell(WifiManager.WIFI_STATE_CHANGED_ACTION, WifiManager.EXTRA_WIFI_STATE, WifiManager.WIFI_STATE_DISABLED);
    tell(WifiManager.WIFI_STATE_CHANGED_ACTION, WifiManager.EXTRA_WIFI_STATE, WifiManager.WIFI_STATE_ENABLED);
    assertEquals(Arrays.asList("wifi_off,", "wifi_on,"), recorded.events());
  }

  @Test public void locationGoingOffIsToldOnce() throws Exception {
    when(location.isProviderEnabled(LocationManager.GPS_PROVIDER)).thenReturn(false);
    tell(LocationManager.MODE_CHANGED_ACTION, "", 0);
    tell(LocationManager.MODE_CHANGED_ACTION, "", 0);
    assertEquals(Collections.singletonList("location_off,"), recorded.events());
  }

  @Test public void aLowBatteryIsTold() throws Exception {
    tell(Intent.ACTION_BATTERY_CHANGED, BatteryManager.EXTRA_LEVEL, 9);
    assertEquals(Collections.singletonList("battery_low,9"), recorded.events());
  }

  @Test public void theScreenIsTold() throws Exception {
    tell(Intent.ACTION_SCREEN_OFF, "", 0);
    tell(Intent.ACTION_SCREEN_ON, "", 0);
    assertEquals(Arrays.asList("screen_off,", "screen_on,"), recorded.events());
  }

  @Test public void aCallIsToldOnce() throws Exception {
    AudioManager audio = mock(AudioManager.class);
    when(audio.getMode()).thenReturn(AudioManager.MODE_IN_CALL);
    Calls calls = new Calls(audio, mock(Handler.class));
    calls.start(recorded.recorder);
    calls.look();
    calls.look();
    assertEquals(Collections.singletonList("phone_call,"), recorded.events());
  }

  private void tell(String action, String extra, int value) {
    Intent intent = mock(Intent.class);
    when(intent.getAction()).thenReturn(action);
    when(intent.getIntExtra(eq(extra), anyInt())).thenReturn(value);
    when(intent.getIntExtra(eq(BatteryManager.EXTRA_SCALE), anyInt())).thenReturn(100);
    surroundings.onReceive(null, intent);
  }
}
