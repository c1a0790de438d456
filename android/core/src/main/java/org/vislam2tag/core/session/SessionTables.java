package org.vislam2tag.core.session;

import java.io.File;
import java.io.IOException;
import java.util.EnumMap;
import java.util.Map;
import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.RowFile;
import org.vislam2tag.core.table.RowSink;
import org.vislam2tag.core.table.Table;

/** All tables of a session being recorded. */
final class SessionTables {
  /** Says which file could not be written. */
  static final class WriteFailure extends IOException {
    private static final long serialVersionUID = 1;
    private static final String[] FULL = {"No space left", "ENOSPC", "Disk quota", "EDQUOT"};

    WriteFailure(Table table, IOException cause) {
      super(table.fileName + ": " + cause.getMessage(), cause);
    }

    /** Is it for want of space? */
    boolean isDiskFull() {
      for (String words : FULL) {
        if (String.valueOf(getCause().getMessage()).contains(words)) {
          return true;
        }
      }
      return false;
    }
  }

  private interface Action {
    void on(RowFile file) throws IOException;
  }

  private final Map<Table, RowFile> files = new EnumMap<>(Table.class);

  /**
   * Opens all tables in a session's folder and writes their headers.
   *
   * @throws IOException if one cannot be written
   */
  SessionTables(File folder, RowSink.Opener opener) throws IOException {
    for (Table table : Table.values()) {
      files.put(table, new RowFile(opener.open(new File(folder, table.fileName)), table.header));
    }
    flush();
  }

  /** Takes a record; what the disk thinks of it {@link #flush} tells. */
  void add(Record record) {
    Row row = new Row();
    record.write(row);
    files.get(record.table()).add(row);
  }

  /** Hands all rows to the operating system. */
  void flush() throws WriteFailure {
    all(RowFile::flush);
  }

  /** Makes sure that all flushed rows survive a loss of power. */
  void force() throws WriteFailure {
    all(RowFile::force);
  }

  /** Closes all, whatever happens to one; throws the first failure. */
  void close() throws WriteFailure {
    all(RowFile::close);
  }

  /** Rows logged so far in a table. */
  long rows(Table table) {
    return files.get(table).rows();
  }

  /** Rows dropped since the last call, as the disk was too slow. */
  long takeDropped(Table table) {
    return files.get(table).takeDropped();
  }

  private void all(Action action) throws WriteFailure {
    WriteFailure first = null;
    for (Map.Entry<Table, RowFile> entry : files.entrySet()) {
      try {
        action.on(entry.getValue());
      } catch (IOException e) {
        first = first == null ? new WriteFailure(entry.getKey(), e) : first;
      }
    }
    if (first != null) {
      throw first;
    }
  }
}
