package org.vislam2tag.core.record;

import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** One reading of one sensor. The values are written at once, so that the platform may use their array again. */
public final class SensorReading implements Record {
  private static final int COLUMNS = 6;

  private final long timeNs;
  private final SensorKind kind;
  private final float[] values;
  private final int accuracy;

  /**
   * A reading.
   *
   * @param timeNs ns on the boot clock
   * @param values in Android's order and units; more than the kind has are left out
   * @param accuracy Android's, -1 to 3
   */
  public SensorReading(long timeNs, SensorKind kind, float[] values, int accuracy) {
    this.timeNs = timeNs;
    this.kind = kind;
    this.values = values;
    this.accuracy = accuracy;
  }

  @Override public Table table() {
    return Table.SENSORS;
  }

  @Override public void write(Row row) {
    row.integer(timeNs).text(kind.name());
    int known = Math.min(kind.values, values.length);
    for (int i = 0; i < COLUMNS; i++) {
      row.number(i < known ? values[i] : Float.NaN);
    }
    row.integer(accuracy);
  }
}
