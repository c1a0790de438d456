package org.vislam2tag.core.session;

import java.io.File;
import java.io.IOException;
import java.io.RandomAccessFile;
import java.nio.file.Files;
import java.util.LinkedHashMap;
import java.util.Map;
import org.vislam2tag.core.json.WholeFile;
import org.vislam2tag.core.table.Table;

/** A session on disk that is not being recorded. */
public final class StoredSession {
  private static final int TAIL = 1 << 16;

  /** Its folder; the name is when it started. */
  public final File folder;
  /** The collector's choices; empty and 0 where session.json is broken. */
  public final String site;
  public final int floor;
  public final String device;
  public final String note;
  /** Length of the recording, s; NaN where its end is not known. */
  public final double durationS;
  /** As {@link EndState#word}; empty where it is not known. */
  public final String end;
  public final String endDetail;
  /** Of all its files. */
  public final long bytes;

  private StoredSession(File folder, Map<String, Object> json) {
    this.folder = folder;
    site = text(json, "site");
    floor = json.get("floor") instanceof Long ? ((Long) json.get("floor")).intValue() : 0;
    device = text(json, "device");
    note = text(json, "note");
    Map<?, ?> start = json.get("start") instanceof Map ? (Map<?, ?>) json.get("start") : new LinkedHashMap<>();
    Map<?, ?> last = json.get("end") instanceof Map ? (Map<?, ?>) json.get("end") : new LinkedHashMap<>();
    end = text(last, "state");
    endDetail = text(last, "detail");
    Object from = start.get("boot_ns");
    Object to = last.get("boot_ns");
    durationS = from instanceof Long && to instanceof Long ? ((Long) to - (Long) from) / 1e9 : Double.NaN;
    bytes = size(folder);
  }

  /** Reads what is known of the session in this folder. */
  static StoredSession of(File folder) {
    Map<String, Object> json;
    try {
      json = SessionFiles.readJson(folder);
    } catch (IOException e) {
      json = new LinkedHashMap<>();
    }
    return new StoredSession(folder, json);
  }

  /**
   * Finishes a session whose recording was killed: says so in session.json, cuts what is half written.
   *
   * @throws IOException if the folder cannot be written
   */
  static void recover(File folder) throws IOException {
    Files.deleteIfExists(WholeFile.unfinished(new File(folder, SessionFiles.JSON)).toPath());
    for (Table table : Table.values()) {
      File file = new File(folder, table.fileName);
      if (file.isFile()) {
        cutToLastRow(file);
      }
    }
    Map<String, Object> json = SessionFiles.readJson(folder);
    SessionJson.end(json, new SessionEnd(EndState.KILLED, ""), null, null);
    SessionFiles.writeJson(folder, json);
  }

  /** Was this session's recording never ended? */
  static boolean isOpen(File folder) {
    try {
      return SessionFiles.readJson(folder).get("end") == null;
    } catch (IOException e) {
      return false;
    }
  }

  private static void cutToLastRow(File file) throws IOException {
    try (RandomAccessFile table = new RandomAccessFile(file, "rw")) {
      byte[] tail = new byte[(int) Math.min(TAIL, table.length())];
      table.seek(table.length() - tail.length);
      table.readFully(tail);
      int end = tail.length;
      while (end > 0 && tail[end - 1] != '\n') {
        end--;
      }
      if (end < tail.length) {
        table.setLength(table.length() - tail.length + end);
      }
    }
  }

  private static long size(File folder) {
    long bytes = 0;
    File[] files = folder.listFiles();
    for (File file : files == null ? new File[0] : files) {
      bytes += file.length();
    }
    return bytes;
  }

  private static String text(Map<?, ?> json, String key) {
    return json.get(key) instanceof String ? (String) json.get(key) : "";
  }
}
