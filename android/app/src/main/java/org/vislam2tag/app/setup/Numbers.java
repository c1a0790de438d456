package org.vislam2tag.app.setup;

import java.util.Locale;

/** Lengths as people type them, with comma or point. */
final class Numbers {
  private Numbers() {}

  /** Metres of a text in centimetres; {@code otherwise} where it is no positive number. */
  static float metres(String centimetres, float otherwise) {
    try {
      float value = Float.parseFloat(centimetres.trim().replace(',', '.')) / 100;
      return value > 0 && !Float.isInfinite(value) ? value : otherwise;
    } catch (NumberFormatException e) {
      return otherwise;
    }
  }

  /** Centimetres of a length, to the millimetre. */
  static String centimetres(float metres) {
    return String.format(Locale.getDefault(), "%.1f", metres * 100);
  }
}
