package org.vislam2tag.core.record;

import java.util.Locale;
import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** One Bluetooth LE advertisement. */
public final class BleReading implements Record {
  /** What stands for "no transmit power told" (Android's {@code TX_POWER_NOT_PRESENT}, and of older calls). */
  public static final int NO_TX_POWER = Integer.MIN_VALUE;

  private final long timeNs;
  private final String address;
  private final String name;
  private final int rssiDbm;
  private final int txPowerDbm;
  private final Beacon beacon;

  /**
   * An advertisement.
   *
   * @param timeNs ns on the boot clock
   * @param name null where none is told
   * @param txPowerDbm {@link #NO_TX_POWER} where none is told
   * @param beacon null where it is no iBeacon
   */
  public BleReading(long timeNs, String address, String name, int rssiDbm, int txPowerDbm, Beacon beacon) {
    this.timeNs = timeNs;
    this.address = address;
    this.name = name;
    this.rssiDbm = rssiDbm;
    this.txPowerDbm = txPowerDbm;
    this.beacon = beacon;
  }

  /** The fields as the platform gave them: time, address, name, level, power, the beacon's company and data. */
  public Object[] told() {
    return new Object[] {timeNs, address, name, rssiDbm, txPowerDbm == NO_TX_POWER ? null : txPowerDbm,
        beacon == null ? null : Beacon.COMPANY, beacon == null ? null : beacon.hex()};
  }

  @Override public Table table() {
    return Table.BLE;
  }

  @Override public void write(Row row) {
    row.integer(timeNs).text(address.toLowerCase(Locale.ROOT)).text(name).integer(rssiDbm);
    row.integer(txPowerDbm, NO_TX_POWER);
    if (beacon == null) {
      row.empty().empty().empty();
    } else {
      row.text(beacon.uuid).integer(beacon.major).integer(beacon.minor);
    }
  }
}
