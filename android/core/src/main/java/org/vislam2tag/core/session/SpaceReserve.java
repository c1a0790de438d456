package org.vislam2tag.core.session;

import java.io.File;
import java.io.IOException;
import java.nio.file.Files;

/**
 * A file beside the sessions that is given up when a session ends, so that session.json can be written though the disk
 * is full.
 */
final class SpaceReserve {
  static final String NAME = ".reserve";
  private static final int BYTES = 256 << 10;

  private final File file;

  /** Takes the space. */
  SpaceReserve(File sessions) throws IOException {
    file = new File(sessions, NAME);
    Files.write(file.toPath(), new byte[BYTES]);
  }

  /** Gives the space up, if it is not given up yet. */
  void release() {
    try {
      Files.deleteIfExists(file.toPath());
    } catch (IOException e) {
      // Then session.json may not fit: the session counts as killed, and the next one uses this file again.
      return;
    }
  }
}
