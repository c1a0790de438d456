package org.vislam2tag.core.session;

import java.io.File;
import java.io.IOException;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.regex.Pattern;

/** All sessions on the phone. */
public final class SessionStore {
  private static final Pattern NAME = Pattern.compile("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{6}(-[0-9]+)?");

  private final File sessions;

  /** In a folder of the app, which need not be there yet. */
  public SessionStore(File sessions) {
    this.sessions = sessions;
  }

  /** Newest first, without the one being recorded in {@code open} (null: none). */
  public List<StoredSession> list(File open) {
    List<StoredSession> found = new ArrayList<>();
    for (File folder : folders(open)) {
      found.add(StoredSession.of(folder));
    }
    return found;
  }

  /**
   * Finishes the sessions whose recording was killed, and removes folders that are empty, as the kill came before the first
   * file; to be called when the app starts.
   *
   * @return the folders of those finished
   */
  public List<File> recover(File open) throws IOException {
    List<File> killed = new ArrayList<>();
    for (File folder : folders(open)) {
      if (StoredSession.isOpen(folder)) {
        StoredSession.recover(folder);
        killed.add(folder);
      } else if (String.join("", folder.list()).isEmpty()) {
        Files.delete(folder.toPath());
      }
    }
    return killed;
  }

  /** Deletes a session for good. */
  public void delete(StoredSession session) throws IOException {
    SessionFiles.delete(session.folder);
  }

  private List<File> folders(File open) {
    File[] found = sessions.listFiles(file -> file.isDirectory() && NAME.matcher(file.getName()).matches() && !file.equals(open));
    List<File> folders = new ArrayList<>(Arrays.asList(found == null ? new File[0] : found));
    Collections.sort(folders, Collections.reverseOrder());
    return folders;
  }
}
