package org.vislam2tag.core.handover;

import java.io.BufferedOutputStream;
import java.io.ByteArrayInputStream;
import java.io.File;
import java.io.FileInputStream;
import java.io.FileOutputStream;
import java.io.IOException;
import java.io.InputStream;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.Calendar;
import java.util.GregorianCalendar;
import java.util.Map;
import java.util.TreeMap;
import java.util.zip.ZipEntry;
import java.util.zip.ZipOutputStream;
import org.vislam2tag.core.json.WholeFile;

/** A session as one zip with checksums (docs/reference/phone-handover.md). The same session gives the same bytes. */
public final class SessionZip {
  /** The file in the zip that holds the checksums of all others. */
  static final String SUMS = "SHA256SUMS";
  private static final int BUFFER = 1 << 16;
  /** Local time in whatever zone; not 1980-01-01, which Java stores a second time, in UTC. */
  private static final long ENTRY_TIME = new GregorianCalendar(1980, Calendar.FEBRUARY, 1).getTimeInMillis();

  /** Is told how far the packing is, and may end it by throwing. */
  public interface Progress {
    void packed(long bytes, long ofBytes) throws IOException;
  }

  private final ZipOutputStream zip;
  private final String folder;
  private final Progress progress;
  private final long ofBytes;
  private long bytes;

  private SessionZip(ZipOutputStream zip, String folder, long ofBytes, Progress progress) {
    this.zip = zip;
    this.folder = folder;
    this.ofBytes = ofBytes;
    this.progress = progress;
  }

  /**
   * Packs a session that is not being recorded; the zip appears whole or not at all.
   *
   * @throws IOException if a file cannot be read or the zip not be written
   */
  public static void pack(File session, File target, Progress progress) throws IOException {
    Map<String, File> files = files(session);
    long ofBytes = 0;
    StringBuilder sums = new StringBuilder();
    for (Map.Entry<String, File> file : files.entrySet()) {
      ofBytes += file.getValue().length();
      sums.append(Sha256.of(file.getValue())).append("  ").append(file.getKey()).append('\n');
    }
    ofBytes += sums.length();
    files.put(SUMS, null);
    File unfinished = WholeFile.unfinished(target);
    try {
      try (ZipOutputStream zip = new ZipOutputStream(new BufferedOutputStream(new FileOutputStream(unfinished), BUFFER))) {
        new SessionZip(zip, session.getName(), ofBytes, progress).addAll(files, sums.toString());
      }
      WholeFile.finish(unfinished, target);
    } finally {
      Files.deleteIfExists(unfinished.toPath());
    }
  }

  private void addAll(Map<String, File> files, String sums) throws IOException {
    for (Map.Entry<String, File> file : files.entrySet()) {
      boolean isSums = file.getKey().equals(SUMS);
      try (InputStream in = isSums ? new ByteArrayInputStream(sums.getBytes(StandardCharsets.UTF_8))
          : new FileInputStream(file.getValue())) {
        add(file.getKey(), in);
      }
    }
  }

  private void add(String name, InputStream in) throws IOException {
    ZipEntry entry = new ZipEntry(folder + "/" + name);
    entry.setTime(ENTRY_TIME);
    zip.putNextEntry(entry);
    byte[] buffer = new byte[BUFFER];
    for (int n = in.read(buffer); n >= 0; n = in.read(buffer)) {
      zip.write(buffer, 0, n);
      bytes += n;
      progress.packed(bytes, ofBytes);
    }
    zip.closeEntry();
  }

  private static Map<String, File> files(File session) throws IOException {
    File[] found = session.listFiles(file -> file.isFile() && !file.getName().endsWith(WholeFile.UNFINISHED));
    if (found == null || found.length == 0) {
      throw new IOException("no session in " + session);
    }
    Map<String, File> files = new TreeMap<>();
    for (File file : found) {
      files.put(file.getName(), file);
    }
    return files;
  }
}
