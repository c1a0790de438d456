package org.vislam2tag.core.json;

import java.io.IOException;
import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

/**
 * Reads JSON to maps, lists, text, {@code Long}, {@code Double}, booleans and nulls. Android's own reader is not there
 * on the JVM, where the core is tested.
 */
public final class JsonReader {
  /** Deeper nesting than any of our files has; so that a hostile text cannot exhaust the stack. */
  private static final int MOST_DEPTH = 32;

  private final String text;
  private int at;
  private int depth;

  private JsonReader(String text) {
    this.text = text;
  }

  /**
   * The one value that the text holds.
   *
   * @throws IOException if it is no JSON
   */
  public static Object read(String text) throws IOException {
    JsonReader reader = new JsonReader(text);
    Object value = reader.value();
    reader.blanks();
    if (reader.at < text.length()) {
      throw reader.wrong("the end");
    }
    return value;
  }

  /**
   * The one object that the text holds.
   *
   * @throws IOException if it holds no JSON object
   */
  @SuppressWarnings("unchecked")
  public static Map<String, Object> readObject(String text) throws IOException {
    Object value = read(text);
    if (!(value instanceof Map)) {
      throw new IOException("no JSON object");
    }
    return (Map<String, Object>) value;
  }

  private Object value() throws IOException {
    blanks();
    switch (peek()) {
      case '{':
        return nested(true);
      case '[':
        return nested(false);
      case '"':
        return string();
      case 't':
        return word("true", Boolean.TRUE);
      case 'f':
        return word("false", Boolean.FALSE);
      case 'n':
        return word("null", null);
      default:
        return number();
    }
  }

  private Object nested(boolean object) throws IOException {
    if (++depth > MOST_DEPTH) {
      throw wrong("less nesting");
    }
    at++;
    Object value = object ? object() : list();
    depth--;
    return value;
  }

  private Map<String, Object> object() throws IOException {
    Map<String, Object> map = new LinkedHashMap<>();
    blanks();
    while (peek() != '}') {
      String key = string();
      blanks();
      expect(':');
      map.put(key, value());
      separator('}');
    }
    at++;
    return map;
  }

  private List<Object> list() throws IOException {
    List<Object> items = new ArrayList<>();
    blanks();
    while (peek() != ']') {
      items.add(value());
      separator(']');
    }
    at++;
    return items;
  }

  /** A comma and blanks, unless the end follows. */
  private void separator(char end) throws IOException {
    blanks();
    if (peek() == end) {
      return;
    }
    expect(',');
    blanks();
    if (peek() == end) {
      throw wrong("a value");
    }
  }

  private String string() throws IOException {
    expect('"');
    StringBuilder out = new StringBuilder();
    while (peek() != '"') {
      char c = text.charAt(at++);
      out.append(c == '\\' ? escaped() : c);
    }
    at++;
    return out.toString();
  }

  private char escaped() throws IOException {
    char c = peek();
    at++;
    if (c == 'u') {
      return unicode();
    }
    int known = "\"\\/bfnrt".indexOf(c);
    if (known < 0) {
      throw wrong("an escape");
    }
    return "\"\\/\b\f\n\r\t".charAt(known);
  }

  private char unicode() throws IOException {
    try {
      at += 4;
      return (char) Integer.parseInt(text.substring(at - 4, at), 16);
    } catch (IndexOutOfBoundsException | NumberFormatException e) {
      throw wrong("four hexadecimal digits");
    }
  }

  private Object word(String word, Object value) throws IOException {
    if (!text.startsWith(word, at)) {
      throw wrong(word);
    }
    at += word.length();
    return value;
  }

  private Object number() throws IOException {
    int start = at;
    while (at < text.length() && "+-.0123456789eE".indexOf(text.charAt(at)) >= 0) {
      at++;
    }
    String digits = text.substring(start, at);
    try {
      if (digits.matches("-?[0-9]+")) {
        return Long.valueOf(digits);
      }
      return Double.valueOf(digits);
    } catch (NumberFormatException e) {
      throw wrong("a value");
    }
  }

  private void expect(char c) throws IOException {
    if (peek() != c) {
      throw wrong("'" + c + "'");
    }
    at++;
  }

  private char peek() throws IOException {
    if (at >= text.length()) {
      throw wrong("more text");
    }
    return text.charAt(at);
  }

  private void blanks() {
    while (at < text.length() && " \t\r\n".indexOf(text.charAt(at)) >= 0) {
      at++;
    }
  }

  private IOException wrong(String expected) {
    return new IOException("JSON: " + expected + " expected at character " + at);
  }
}
