package org.vislam2tag.core.table;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;
import static org.junit.Assert.fail;
import static org.junit.Assume.assumeTrue;

import java.io.ByteArrayOutputStream;
import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;

public class RowFileTest {
  /** Of each of the threads that add at once. */
  private static final int ROWS = 20_000;

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();

  /** A disk that takes so many bytes. */
  static final class LimitedSink implements RowSink {
    private final ByteArrayOutputStream bytes = new ByteArrayOutputStream();
    private final long before;
    private final int limit;
    private final List<Integer> writes = new ArrayList<>();

    LimitedSink(long before, int limit) {
      this.before = before;
      this.limit = limit;
    }

    String text() {
      return new String(bytes.toByteArray(), StandardCharsets.UTF_8);
    }

    @Override public void write(byte[] data, int length) throws IOException {
      int fits = Math.min(length, limit - bytes.size());
      bytes.write(data, 0, fits);
      writes.add(bytes.size());
      if (fits < length) {
        throw new IOException("No space left on device");
      }
    }

    @Override public long size() {
      return before + bytes.size();
    }

    @Override public void truncate(long size) {
      byte[] kept = Arrays.copyOf(bytes.toByteArray(), Math.toIntExact(size - before));
      bytes.reset();
      bytes.write(kept, 0, kept.length);
    }

    @Override public void force() {}

    @Override public void close() {}
  }

  private static Row row(String text) {
    return new Row().text(text);
  }

  @Test public void rowsWaitForTheFlushAndStayWhole() throws IOException {
    LimitedSink sink = new LimitedSink(0, 1 << 20);
    RowFile file = new RowFile(sink, "h");
    file.add(row("a"));
    assertEquals("", sink.text());
    file.flush();
    assertEquals("h\na\n", sink.text());
    file.add(row("ü"));
    file.close();
    assertEquals("h\na\nü\n", sink.text());
    assertEquals(2, file.rows());
  }

  @Test public void afterTheEndRowsAreIgnored() throws IOException {
    LimitedSink sink = new LimitedSink(0, 100);
    RowFile file = new RowFile(sink, "h");
    file.close();
    file.add(row("late"));
    file.flush();
    assertEquals("h\n", sink.text());
    assertEquals(0, file.rows());
  }

  @Test public void aFullDiskLeavesWholeRows() throws IOException {
    for (int limit = 0; limit < 30; limit++) {
      LimitedSink sink = new LimitedSink(0, limit);
      RowFile file = new RowFile(sink, "head");
      for (int i = 0; i < 10; i++) {
        file.add(row("x" + i));
      }
      try {
        file.flush();
        fail("a disk of " + limit + " bytes took 35");
      } catch (IOException expected) {
        String whole = "head\nx0\nx1\nx2\nx3\nx4\nx5\nx6\nx7\nx8\nx9\n".substring(0, limit);
        assertEquals(whole.substring(0, whole.lastIndexOf('\n') + 1), sink.text());
      }
    }
  }

  @Test public void filesOfMoreThanFourGigabytesAreCutToo() throws IOException {
    long large = 5_000_000_000L;
    LimitedSink sink = new LimitedSink(large, 7);
    RowFile file = new RowFile(sink, "head");
    file.add(row("xyz"));
    try {
      file.flush();
      fail("no failure");
    } catch (IOException expected) {
      assertEquals(large + 5, sink.size());
    }
  }

  @Test public void aDiskThatIsTooSlowCostsRowsThatAreCounted() {
    RowFile file = new RowFile(new LimitedSink(0, 0), "h");
    char[] long1k = new char[1023];
    Arrays.fill(long1k, 'x');
    Row row = row(new String(long1k));
    int fits = RowFile.MOST_WAITING / 1024 - 1;
    for (int i = 0; i < fits + 3; i++) {
      file.add(row);
    }
    assertEquals(fits, file.rows());
    assertEquals(3, file.takeDropped());
    assertEquals(0, file.takeDropped());
  }

  @Test public void manyThreadsMayAddWhileOneFlushes() throws Exception {
    LimitedSink sink = new LimitedSink(0, 1 << 24);
    RowFile file = new RowFile(sink, "h,i");
    ExecutorService threads = Executors.newFixedThreadPool(4);
    for (int t = 0; t < 4; t++) {
      int thread = t;
      threads.execute(() -> {
        for (int i = 0; i < ROWS; i++) {
          file.add(new Row().integer(thread).integer(i));
        }
      });
    }
    threads.shutdown();
    while (!threads.isTerminated()) {
      file.flush();
    }
    file.close();
    String text = sink.text();
    for (int end : sink.writes) {
      assertEquals('\n', text.charAt(end - 1));
    }
    int[] next = new int[4];
    String[] lines = text.split("\n");
    for (int i = 1; i < lines.length; i++) {
      String[] fields = lines[i].split(",");
      assertEquals(next[Integer.parseInt(fields[0])]++, Integer.parseInt(fields[1]));
    }
    assertEquals(4 * ROWS + 1, lines.length);
  }

  @Test public void aFileTakesUpWhereItEnded() throws IOException {
    File path = new File(temporary.getRoot(), "t.csv");
    try (RowSink sink = new FileSink(path)) {
      sink.write(new byte[] {'a', '\n', 'b'}, 3);
      assertEquals(3, sink.size());
      sink.truncate(2);
      sink.force();
    }
    try (RowSink sink = new FileSink(path)) {
      sink.write(new byte[] {'c', '\n'}, 2);
    }
    assertEquals("a\nc\n", new String(Files.readAllBytes(path.toPath()), StandardCharsets.UTF_8));
  }

  @Test public void aDeviceThatIsReallyFullIsAFailure() throws IOException {
    File full = new File("/dev/full");
    assumeTrue("no /dev/full on this system", full.exists());
    try (RowSink sink = new FileSink(full)) {
      RowFile file = new RowFile(sink, "h");
      file.flush();
      fail("/dev/full took a byte");
    } catch (IOException e) {
      assertTrue(e.getMessage(), e.getMessage().contains("No space left"));
    }
  }
}
