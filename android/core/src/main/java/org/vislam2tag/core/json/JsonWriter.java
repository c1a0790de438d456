package org.vislam2tag.core.json;

import java.util.List;
import java.util.Map;

/** Writes JSON from maps, lists, text, numbers, booleans and nulls; two blanks a level, keys in the map's order. */
public final class JsonWriter {
  private final StringBuilder out = new StringBuilder();

  private JsonWriter() {}

  /** The value as JSON text, ended by a line feed. */
  public static String write(Object value) {
    JsonWriter writer = new JsonWriter();
    writer.value(value, "\n");
    return writer.out.append('\n').toString();
  }

  private void value(Object value, String newLine) {
    if (value instanceof Map) {
      object((Map<?, ?>) value, newLine);
    } else if (value instanceof List) {
      list((List<?>) value, newLine);
    } else if (value == null || value instanceof Boolean || value instanceof Integer || value instanceof Long) {
      out.append(value);
    } else if (value instanceof Number) {
      number(((Number) value).doubleValue());
    } else {
      text(value.toString());
    }
  }

  private void object(Map<?, ?> map, String newLine) {
    String separator = "{" + newLine + "  ";
    for (Map.Entry<?, ?> entry : map.entrySet()) {
      out.append(separator);
      text(String.valueOf(entry.getKey()));
      out.append(": ");
      value(entry.getValue(), newLine + "  ");
      separator = "," + newLine + "  ";
    }
    out.append(map.isEmpty() ? "{}" : newLine + "}");
  }

  private void list(List<?> list, String newLine) {
    String separator = "[" + newLine + "  ";
    for (Object item : list) {
      out.append(separator);
      value(item, newLine + "  ");
      separator = "," + newLine + "  ";
    }
    out.append(list.isEmpty() ? "[]" : newLine + "]");
  }

  /** Whole numbers without a point; JSON knows no NaN: null. */
  private void number(double value) {
    if (Double.isNaN(value) || Double.isInfinite(value)) {
      out.append("null");
    } else if (value == Math.rint(value) && Math.abs(value) < 1e15) {
      out.append((long) value);
    } else {
      out.append(value);
    }
  }

  private void text(String text) {
    out.append('"');
    for (int i = 0; i < text.length(); i++) {
      character(text.charAt(i), i + 1 < text.length() && Character.isLowSurrogate(text.charAt(i + 1)),
          i > 0 && Character.isHighSurrogate(text.charAt(i - 1)));
    }
    out.append('"');
  }

  /** Escapes what JSON wants escaped, and halves of characters, which UTF-8 cannot hold. */
  private void character(char c, boolean lowFollows, boolean highBefore) {
    boolean half = Character.isHighSurrogate(c) && !lowFollows || Character.isLowSurrogate(c) && !highBefore;
    if (c == '"' || c == '\\') {
      out.append('\\').append(c);
    } else if (c == '\n') {
      out.append("\\n");
    } else if (c < ' ' || c == '\u007F') {
      out.append("\\u00").append(Character.forDigit(c >> 4, 16)).append(Character.forDigit(c & 0xF, 16));
    } else {
      out.append(half ? '\uFFFD' : c);
    }
  }
}
