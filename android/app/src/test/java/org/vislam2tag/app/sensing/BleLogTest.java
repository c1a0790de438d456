package org.vislam2tag.app.sensing;

import static org.junit.Assert.assertEquals;
import static org.mockito.ArgumentMatchers.any;
import static org.mockito.ArgumentMatchers.argThat;
import static org.mockito.ArgumentMatchers.eq;
import static org.mockito.ArgumentMatchers.isNull;
import static org.mockito.Mockito.doThrow;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.times;
import static org.mockito.Mockito.verify;
import static org.mockito.Mockito.when;

import android.bluetooth.BluetoothAdapter;
import android.bluetooth.BluetoothDevice;
import android.bluetooth.le.BluetoothLeScanner;
import android.bluetooth.le.ScanResult;
import android.os.Handler;
import java.util.Collections;
import java.util.List;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.Recorded;

public class BleLogTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final BluetoothAdapter adapter = mock(BluetoothAdapter.class);
  private final BluetoothLeScanner scanner = mock(BluetoothLeScanner.class);
  private final Handler handler = mock(Handler.class);
  private Recorded recorded;

  @Before public void start() throws Exception {
    recorded = new Recorded(folder.getRoot());
    when(adapter.isEnabled()).thenReturn(true);
    when(adapter.getBluetoothLeScanner()).thenReturn(scanner);
  }

  @Test public void anAdvertisementIsARow() throws Exception {
    BluetoothDevice device = mock(BluetoothDevice.class);
    when(device.getAddress()).thenReturn("AA:BB:CC:DD:EE:FF");
    ScanResult heard = mock(ScanResult.class);
    when(heard.getDevice()).thenReturn(device);
    when(heard.getRssi()).thenReturn(-80);
    when(heard.getTimestampNanos()).thenReturn(5L);
    when(heard.getTxPower()).thenReturn(ScanResult.TX_POWER_NOT_PRESENT);
    BleLog log = new BleLog(adapter, handler);
    log.start(recorded.recorder);
    log.onScanResult(0, heard);
    List<String> rows = recorded.rows("Ble.csv");
    assertEquals(Collections.singletonList("aa:bb:cc:dd:ee:ff,,-80,,,,"), rows);
  }

  @Test public void switchedOffIsAnEvent() throws Exception {
    when(adapter.isEnabled()).thenReturn(false);
    new BleLog(adapter, handler).start(recorded.recorder);
    assertEquals(Collections.singletonList("bluetooth_off,"), recorded.events());
  }

  @Test public void aMissingPermissionIsAnEvent() throws Exception {
    doThrow(new SecurityException()).when(scanner).startScan(any(), any(), any(BleLog.class));
    BleLog log = new BleLog(adapter, handler);
    log.start(recorded.recorder);
    log.stop();
    assertEquals(Collections.singletonList("no_bluetooth_permission,"), recorded.events());
  }

  @Test public void withTheScreenOffBeaconsAreAskedFor() {
    BleLog log = new BleLog(adapter, handler);
    log.screen(false); // before it listens
    log.start(recorded.recorder);
    verify(scanner).startScan(argThat(filters -> filters != null && filters.size() == 2), any(), any(BleLog.class));
    log.screen(true);
    verify(handler).postDelayed(any(), eq(BleLog.SCREEN_MS));
    log.renew();
    verify(scanner).startScan(isNull(), any(), any(BleLog.class));
  }

  @Test public void aLongScanIsBegunAnewBeforeAndroidSlowsItDown() {
    BleLog log = new BleLog(adapter, handler);
    log.start(recorded.recorder);
    log.renew();
    verify(scanner, times(2)).startScan(any(), any(), any(BleLog.class));
    verify(scanner).stopScan(log);
    verify(handler, times(2)).postDelayed(any(), eq(BleLog.RENEW_MS));
    log.stop();
    log.renew();
    verify(scanner, times(2)).startScan(any(), any(), any(BleLog.class));
  }
}
