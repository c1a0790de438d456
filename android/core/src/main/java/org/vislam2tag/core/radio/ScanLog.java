package org.vislam2tag.core.radio;

import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import org.vislam2tag.core.record.WifiReading;
import org.vislam2tag.core.record.WifiRow;

/** Numbers the deliveries of Wi-Fi results and counts what was new in them. */
public final class ScanLog {
  private final Map<String, Long> newestUs = new HashMap<>();
  private int deliveries;
  private int refused;
  private int failed;
  private long newReadings;
  private String throttling;

  /** The rows of a delivery at {@code receivedNs} on the boot clock: all of its list, what was told before too. */
  public List<WifiRow> delivered(long receivedNs, boolean fresh, List<WifiReading> readings) {
    List<WifiRow> rows = new ArrayList<>(readings.size());
    for (WifiReading reading : readings) {
      rows.add(new WifiRow(reading, deliveries, receivedNs, fresh, throttling));
      Long before = newestUs.put(reading.bssid, reading.timestampUs);
      if (before == null || before != reading.timestampUs) {
        newReadings++;
      }
    }
    deliveries++;
    failed += fresh ? 0 : 1;
    return rows;
  }

  /** A scan was asked for and refused. */
  public void refused() {
    refused++;
  }

  /** Notes whether the platform throttles scans; true if that is news. */
  public boolean throttling(boolean on) {
    String word = on ? "on" : "off";
    boolean news = !word.equals(throttling);
    throttling = word;
    return news;
  }

  /** Deliveries so far. */
  public int deliveries() {
    return deliveries;
  }

  /** Scans that were refused when asked for. */
  public int refusals() {
    return refused;
  }

  /** Deliveries of older readings, as the scan had failed. */
  public int failures() {
    return failed;
  }

  /** Readings that no delivery had told before. */
  public long newReadings() {
    return newReadings;
  }

  /** Does the platform throttle scans: {@code on}, {@code off}, or null where it does not tell? */
  public String throttling() {
    return throttling;
  }
}
