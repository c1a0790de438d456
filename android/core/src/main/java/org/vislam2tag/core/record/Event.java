package org.vislam2tag.core.record;

import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** Something that happened; its names are listed in docs/reference/phone-format.md. */
public final class Event implements Record {
  private final long timeNs;
  private final String name;
  private final String detail;

  /** At {@code timeNs} on the boot clock; the detail may be empty. */
  public Event(long timeNs, String name, String detail) {
    this.timeNs = timeNs;
    this.name = name;
    this.detail = detail;
  }

  @Override public Table table() {
    return Table.EVENTS;
  }

  @Override public void write(Row row) {
    row.integer(timeNs).text(name).text(detail);
  }
}
