package org.vislam2tag.core.json;

import java.io.File;
import java.io.FileOutputStream;
import java.io.IOException;
import java.io.OutputStream;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.nio.file.StandardCopyOption;

/** Small files that are written whole or not at all, whenever the phone goes off. */
public final class WholeFile {
  /** Ends the name of a file that is being written, and is no part of what it is written for. */
  public static final String UNFINISHED = ".tmp";

  private WholeFile() {}

  /** Writes text in place of what the file held. */
  public static void write(File target, String text) throws IOException {
    File unfinished = unfinished(target);
    try (FileOutputStream file = new FileOutputStream(unfinished); OutputStream out = file) {
      out.write(text.getBytes(StandardCharsets.UTF_8));
      file.getFD().sync();
    }
    finish(unfinished, target);
  }

  /** Where a file is written that becomes this one. */
  public static File unfinished(File target) {
    return new File(target.getPath() + UNFINISHED);
  }

  /** Puts what was written in the file's place. */
  public static void finish(File unfinished, File target) throws IOException {
    Files.move(unfinished.toPath(), target.toPath(), StandardCopyOption.ATOMIC_MOVE, StandardCopyOption.REPLACE_EXISTING);
  }
}
