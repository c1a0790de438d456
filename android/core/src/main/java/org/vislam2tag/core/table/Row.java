package org.vislam2tag.core.table;

/**
 * One line of a table, made field by field: CSV after RFC 4180 with a decimal point in every locale and without a line
 * break in any field (docs/reference/phone-format.md, tables).
 */
public final class Row {
  private static final char REPLACEMENT = '\uFFFD';

  private final StringBuilder line = new StringBuilder(128);
  private int fields;

  /** A whole number. */
  public Row integer(long value) {
    next().append(value);
    return this;
  }

  /** A whole number, or nothing where it is {@code missing}. */
  public Row integer(int value, int missing) {
    return value == missing ? empty() : integer(value);
  }

  /** A float with the digits that read back as the same float; nothing where it is no finite number. */
  public Row number(float value) {
    if (Float.isNaN(value) || Float.isInfinite(value)) {
      return empty();
    }
    next().append(Float.toString(value));
    return this;
  }

  /** Text; null is an empty field. */
  public Row text(String value) {
    if (value == null) {
      return empty();
    }
    String clean = oneLine(value);
    StringBuilder out = next();
    if (needsQuotes(clean)) {
      out.append('"').append(clean.replace("\"", "\"\"")).append('"');
    } else {
      out.append(clean);
    }
    return this;
  }

  /** A field without a value. */
  public Row empty() {
    next();
    return this;
  }

  /** How many fields the row has so far. */
  public int fields() {
    return fields;
  }

  /** The row as a line, its end included. */
  public String line() {
    return line + "\n";
  }

  private StringBuilder next() {
    if (fields++ > 0) {
      line.append(',');
    }
    return line;
  }

  private static boolean needsQuotes(String text) {
    return text.indexOf(',') >= 0 || text.indexOf('"') >= 0 || text.startsWith(" ") || text.endsWith(" ");
  }

  /** The text with U+FFFD for every control character and every half of a character. */
  static String oneLine(String text) {
    StringBuilder clean = new StringBuilder(text.length());
    for (int i = 0; i < text.length(); i++) {
      char c = text.charAt(i);
      boolean pair = Character.isHighSurrogate(c) && i + 1 < text.length() && Character.isLowSurrogate(text.charAt(i + 1));
      if (pair) {
        clean.append(c).append(text.charAt(++i));
      } else {
        clean.append(c < ' ' || c == '\u007F' || Character.isSurrogate(c) ? REPLACEMENT : c);
      }
    }
    return clean.toString();
  }
}
