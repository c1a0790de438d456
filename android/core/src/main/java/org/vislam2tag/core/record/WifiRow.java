package org.vislam2tag.core.record;

import java.util.Locale;
import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** A Wi-Fi reading within the delivery that brought it. */
public final class WifiRow implements Record {
  private final WifiReading reading;
  private final int scan;
  private final long receivedNs;
  private final boolean fresh;
  private final String throttling;

  /**
   * A row of a delivery.
   *
   * @param scan number of the delivery, from 0
   * @param receivedNs when it was delivered, ns on the boot clock
   * @param fresh did the platform say that the scan succeeded?
   * @param throttling {@code on}, {@code off}, or null where the platform does not tell
   */
  public WifiRow(WifiReading reading, int scan, long receivedNs, boolean fresh, String throttling) {
    this.reading = reading;
    this.scan = scan;
    this.receivedNs = receivedNs;
    this.fresh = fresh;
    this.throttling = throttling;
  }

  @Override public Table table() {
    return Table.WIFI;
  }

  @Override public void write(Row row) {
    row.integer(reading.timestampUs * 1000).integer(scan).text(reading.bssid.toLowerCase(Locale.ROOT)).text(reading.ssid);
    row.integer(reading.rssiDbm).integer(reading.frequencyMhz).integer(reading.channelWidthMhz, 0);
    row.integer(reading.center0Mhz, 0).integer(reading.center1Mhz, 0).integer(receivedNs);
    row.text(fresh ? "fresh" : "cached").text(throttling);
  }
}
