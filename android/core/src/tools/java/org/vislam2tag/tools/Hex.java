package org.vislam2tag.tools;

/** Bytes written as hexadecimal digits. */
final class Hex {
  private Hex() {}

  /** The bytes of an even number of digits. */
  static byte[] bytes(String digits) {
    byte[] bytes = new byte[digits.length() / 2];
    for (int i = 0; i < bytes.length; i++) {
      bytes[i] = (byte) Integer.parseInt(digits.substring(2 * i, 2 * i + 2), 16);
    }
    return bytes;
  }
}
