package org.vislam2tag.core.record;

import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** A press of the control-point button, or that it was taken back. */
public final class Press implements Record {
  private final long timeNs;
  private final int number;
  private final boolean undone;

  /** At {@code timeNs} on the boot clock; presses are counted from 0. */
  public Press(long timeNs, int number, boolean undone) {
    this.timeNs = timeNs;
    this.number = number;
    this.undone = undone;
  }

  @Override public Table table() {
    return Table.PRESSES;
  }

  @Override public void write(Row row) {
    row.integer(timeNs).integer(number).text(undone ? "undo" : "press");
  }
}
