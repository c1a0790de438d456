package org.vislam2tag.core.handover;

import java.io.File;
import java.io.FileInputStream;
import java.io.IOException;
import java.io.InputStream;
import java.io.RandomAccessFile;
import java.security.MessageDigest;
import java.security.NoSuchAlgorithmException;

/** SHA-256 as 64 lower-case hexadecimal digits. */
final class Sha256 {
  private static final int BUFFER = 1 << 16;

  private Sha256() {}

  /** Of a file's bytes. */
  static String of(File file) throws IOException {
    MessageDigest digest = digest();
    try (InputStream in = new FileInputStream(file)) {
      byte[] buffer = new byte[BUFFER];
      for (int n = in.read(buffer); n >= 0; n = in.read(buffer)) {
        digest.update(buffer, 0, n);
      }
    }
    return hexadecimal(digest.digest());
  }

  /** Of bytes. */
  static String of(byte[] bytes) {
    return hexadecimal(digest().digest(bytes));
  }

  /** Of {@code length} bytes of a file from {@code from} on. */
  static String of(RandomAccessFile file, long from, long length) throws IOException {
    MessageDigest digest = digest();
    byte[] buffer = new byte[BUFFER];
    file.seek(from);
    for (long done = 0; done < length; ) {
      int n = (int) Math.min(buffer.length, length - done);
      file.readFully(buffer, 0, n);
      digest.update(buffer, 0, n);
      done += n;
    }
    return hexadecimal(digest.digest());
  }

  static String hexadecimal(byte[] bytes) {
    StringBuilder text = new StringBuilder(2 * bytes.length);
    for (byte b : bytes) {
      text.append(Character.forDigit(b >> 4 & 0xF, 16)).append(Character.forDigit(b & 0xF, 16));
    }
    return text.toString();
  }

  private static MessageDigest digest() {
    try {
      return MessageDigest.getInstance("SHA-256");
    } catch (NoSuchAlgorithmException e) {
      throw new IllegalStateException("every Java has SHA-256", e);
    }
  }
}
