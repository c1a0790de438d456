package org.vislam2tag.core.table;

import java.io.ByteArrayOutputStream;
import java.io.Closeable;
import java.io.IOException;
import java.nio.charset.StandardCharsets;

/**
 * A table being written. {@link #add} only keeps the row in memory and may be called from any thread at any rate;
 * {@link #flush} hands whole rows to the sink. A kill while the system takes them may cut the last; the next start of the
 * app removes what is left of it.
 */
public final class RowFile implements Closeable {
  /** More than this is not kept waiting for a slow disk, bytes; later rows are dropped and counted. */
  static final int MOST_WAITING = 16 << 20;

  /** Gives its bytes without a copy. */
  private static final class Waiting extends ByteArrayOutputStream {
    byte[] bytes() {
      return buf;
    }
  }

  private final RowSink sink;
  private final Object writing = new Object();
  private Waiting waiting = new Waiting();
  private Waiting spare = new Waiting();
  private long rows;
  private long dropped;
  private boolean closed;

  /** Starts the table with its header line. */
  public RowFile(RowSink sink, String header) {
    this.sink = sink;
    byte[] line = (header + "\n").getBytes(StandardCharsets.UTF_8);
    waiting.write(line, 0, line.length);
  }

  /** Takes a row; does nothing when the table is closed. */
  public synchronized void add(Row row) {
    if (closed) {
      return;
    }
    byte[] line = row.line().getBytes(StandardCharsets.UTF_8);
    if (waiting.size() + line.length > MOST_WAITING) {
      dropped++;
      return;
    }
    waiting.write(line, 0, line.length);
    rows++;
  }

  /** Rows taken so far, without the header. */
  public synchronized long rows() {
    return rows;
  }

  /** Rows that were dropped since the last call, as the disk was too slow. */
  public synchronized long takeDropped() {
    long count = dropped;
    dropped = 0;
    return count;
  }

  /**
   * Hands all waiting rows to the sink.
   *
   * @throws IOException if it takes them not or not all; it is then cut back to its last whole row
   */
  public void flush() throws IOException {
    synchronized (writing) {
      Waiting full = swap();
      if (full.size() == 0) {
        return;
      }
      long before = sink.size();
      try {
        sink.write(full.bytes(), full.size());
      } catch (IOException e) {
        cutBack(before, full);
        throw e;
      } finally {
        full.reset();
      }
    }
  }

  /** Makes sure that all flushed rows survive a loss of power. */
  public void force() throws IOException {
    synchronized (writing) {
      sink.force();
    }
  }

  /** Flushes, forces and closes; takes no rows any more, whatever happens. */
  @Override public void close() throws IOException {
    synchronized (this) {
      closed = true;
    }
    synchronized (writing) {
      try {
        flush();
        sink.force();
      } finally {
        sink.close();
      }
    }
  }

  private synchronized Waiting swap() {
    Waiting full = waiting;
    waiting = spare;
    spare = full;
    return full;
  }

  private void cutBack(long before, Waiting full) {
    try {
      int written = (int) Math.max(0, Math.min(sink.size() - before, full.size()));
      int end = written;
      while (end > 0 && full.bytes()[end - 1] != '\n') {
        end--;
      }
      sink.truncate(before + end);
    } catch (IOException e) {
      // The disk takes nothing at all any more; the next start of the app cuts the table (StoredSession.recover).
      return;
    }
  }
}
