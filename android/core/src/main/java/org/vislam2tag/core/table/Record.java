package org.vislam2tag.core.table;

/** Something that was logged: one row of one table. */
public interface Record {
  /** The table that it belongs to. */
  Table table();

  /** Adds its fields, in the order of the table's header. */
  void write(Row row);
}
