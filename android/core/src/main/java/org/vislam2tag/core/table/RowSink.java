package org.vislam2tag.core.table;

import java.io.Closeable;
import java.io.File;
import java.io.IOException;

/** Where a table's bytes go: a file; in tests something that fails when it should. */
public interface RowSink extends Closeable {
  /** Opens the sink for a file that is not there yet. */
  interface Opener {
    RowSink open(File file) throws IOException;
  }

  /** Appends bytes; when it fails some of them may have been written. */
  void write(byte[] bytes, int length) throws IOException;

  /** How many bytes are in it. */
  long size() throws IOException;

  /** Cuts it back to {@code size} bytes. */
  void truncate(long size) throws IOException;

  /** Makes sure that what was written survives a loss of power. */
  void force() throws IOException;
}
