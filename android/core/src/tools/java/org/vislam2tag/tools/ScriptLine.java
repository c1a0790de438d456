package org.vislam2tag.tools;

import java.util.ArrayList;
import java.util.List;

/** One line of a script: a word and its fields (docs/reference/phone-format.md). */
final class ScriptLine {
  private final int number;
  private final List<String> fields;
  private int next = 1;

  ScriptLine(int number, String line) {
    this.number = number;
    this.fields = split(line);
  }

  /** What the line is: {@code frame}, {@code image}, ... */
  String word() {
    return fields.get(0);
  }

  /** The next field as text; may be empty. */
  String text() {
    if (next >= fields.size()) {
      throw wrong("field " + next + " is missing");
    }
    return unescaped(fields.get(next++));
  }

  /** The next field as text, or {@code other} where it is empty or the line ends. */
  String textOr(String other) {
    String text = isAtEnd() ? "" : text();
    return text.isEmpty() ? other : text;
  }

  /** The next field as a whole number. */
  long integer() {
    String text = text();
    try {
      return Long.parseLong(text);
    } catch (NumberFormatException e) {
      throw wrong("\"" + text + "\" is no whole number");
    }
  }

  /** The next field as a whole number, or {@code other} where it is empty. */
  int integerOr(int other) {
    String text = text();
    next--;
    return text.isEmpty() ? skip(other) : Math.toIntExact(integer());
  }

  /** The next field as a float; NaN where it is empty. */
  float number() {
    String text = text();
    try {
      return text.isEmpty() ? Float.NaN : Float.parseFloat(text);
    } catch (NumberFormatException e) {
      throw wrong("\"" + text + "\" is no number");
    }
  }

  /** The next field as one of the constants of an enum. */
  <E extends Enum<E>> E oneOf(Class<E> type) {
    String text = text();
    try {
      return Enum.valueOf(type, text);
    } catch (IllegalArgumentException e) {
      throw wrong("\"" + text + "\" is no " + type.getSimpleName());
    }
  }

  /** The next field as {@code yes} (true) or {@code no} (false). */
  boolean either(String yes, String no) {
    String text = text();
    if (!text.equals(yes) && !text.equals(no)) {
      throw wrong("\"" + text + "\" is neither \"" + yes + "\" nor \"" + no + "\"");
    }
    return text.equals(yes);
  }

  /** Has every field been read? */
  boolean isAtEnd() {
    return next >= fields.size();
  }

  /** The fault of this line. */
  ScriptException wrong(String message) {
    return new ScriptException(number, word() + ": " + message);
  }

  private int skip(int other) {
    next++;
    return other;
  }

  private static List<String> split(String line) {
    List<String> fields = new ArrayList<>();
    int from = 0;
    for (int tab = line.indexOf('\t'); tab >= 0; tab = line.indexOf('\t', from)) {
      fields.add(line.substring(from, tab));
      from = tab + 1;
    }
    fields.add(line.substring(from));
    return fields;
  }

  private String unescaped(String field) {
    if (field.indexOf('\\') < 0) {
      return field;
    }
    StringBuilder text = new StringBuilder();
    for (int i = 0; i < field.length(); i++) {
      char c = field.charAt(i);
      text.append(c == '\\' ? escape(i + 1 < field.length() ? field.charAt(++i) : ' ') : c);
    }
    return text.toString();
  }

  private char escape(char c) {
    int known = "tnr\\".indexOf(c);
    if (known < 0) {
      throw wrong("unknown escape \\" + c);
    }
    return "\t\n\r\\".charAt(known);
  }
}
