package org.vislam2tag.core.session;

import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.time.ZoneId;
import java.util.Map;
import org.vislam2tag.core.clock.WallTime;
import org.vislam2tag.core.json.JsonReader;
import org.vislam2tag.core.json.JsonWriter;
import org.vislam2tag.core.json.WholeFile;

/** A session's folder and its session.json. */
public final class SessionFiles {
  /** The file that says who, where, which clocks, and how it ended. */
  public static final String JSON = "session.json";
  private static final int MOST_IN_A_SECOND = 1000;

  private SessionFiles() {}

  /**
   * Makes the folder of a session that starts now.
   *
   * @throws IOException if it cannot be made
   */
  static File create(File sessions, long wallMs, ZoneId zone) throws IOException {
    Files.createDirectories(sessions.toPath());
    String name = WallTime.folderName(wallMs, zone);
    for (int n = 1; n <= MOST_IN_A_SECOND; n++) {
      File folder = new File(sessions, n == 1 ? name : name + "-" + n);
      if (folder.mkdir()) {
        return folder;
      }
      if (!folder.exists()) {
        throw new IOException("cannot make the folder " + folder);
      }
    }
    throw new IOException("no free name for a session at " + name + " in " + sessions);
  }

  /** Writes session.json whole or not at all. */
  static void writeJson(File folder, Map<String, Object> json) throws IOException {
    WholeFile.write(new File(folder, JSON), JsonWriter.write(json));
  }

  /** Reads session.json; throws an IOException where it is not there or broken. */
  static Map<String, Object> readJson(File folder) throws IOException {
    byte[] bytes = Files.readAllBytes(new File(folder, JSON).toPath());
    return JsonReader.readObject(new String(bytes, StandardCharsets.UTF_8));
  }

  /** Deletes a session for good, session.json last, so that a half-deleted one is still seen. */
  static void delete(File folder) throws IOException {
    File[] files = folder.listFiles();
    for (File file : files == null ? new File[0] : files) {
      if (!file.getName().equals(JSON)) {
        Files.delete(file.toPath());
      }
    }
    Files.deleteIfExists(new File(folder, JSON).toPath());
    Files.delete(folder.toPath());
  }
}
