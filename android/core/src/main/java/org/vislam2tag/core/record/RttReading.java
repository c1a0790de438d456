package org.vislam2tag.core.record;

import java.util.Locale;
import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** One range to an access point, of the round-trip time of a burst of frames (IEEE 802.11mc). */
public final class RttReading implements Record {
  private static final float MM = 1000;

  private final long timestampMs;
  private final String bssid;
  private final boolean responder;
  private final int distanceMm;
  private final int sigmaMm;
  private final int rssiDbm;
  private final int attempted;
  private final int successful;

  /**
   * A range that succeeded, as Android's {@code RangingResult} gives it.
   *
   * @param timestampMs milliseconds since boot
   * @param responder does the access point answer ranging, or was the time of an ordinary answer taken?
   * @param distanceMm may be negative near the access point
   * @param sigmaMm standard deviation within the burst
   */
  public RttReading(long timestampMs, String bssid, boolean responder, int distanceMm, int sigmaMm, int rssiDbm, int attempted,
      int successful) {
    this.timestampMs = timestampMs;
    this.bssid = bssid;
    this.responder = responder;
    this.distanceMm = distanceMm;
    this.sigmaMm = sigmaMm;
    this.rssiDbm = rssiDbm;
    this.attempted = attempted;
    this.successful = successful;
  }

  /** The numbers as the platform gave them: time, address, whether it answers, range, its sigma, level, frames of the burst. */
  public Object[] told() {
    return new Object[] {timestampMs, bssid, responder ? "responder" : "other", distanceMm, sigmaMm, rssiDbm, attempted, successful};
  }

  @Override public Table table() {
    return Table.RTT;
  }

  @Override public void write(Row row) {
    row.integer(timestampMs * 1_000_000).text(bssid.toLowerCase(Locale.ROOT)).integer(responder ? 1 : 0);
    row.number(distanceMm / MM).number(sigmaMm / MM).integer(rssiDbm).integer(attempted).integer(successful);
  }
}
