package org.vislam2tag.core.landmarks;

import java.util.ArrayList;
import java.util.List;

/** Rows of a CSV text after RFC 4180; line ends of any kind, a byte order mark or none. */
final class CsvText {
  private final String text;
  private int at;

  private CsvText(String text) {
    this.text = text;
    at = text.startsWith("\uFEFF") ? 1 : 0;
  }

  /** All rows that are not empty. */
  static List<List<String>> rows(String text) {
    CsvText csv = new CsvText(text);
    List<List<String>> rows = new ArrayList<>();
    while (csv.at < text.length()) {
      List<String> row = csv.row();
      if (row.size() > 1 || !row.get(0).isEmpty()) {
        rows.add(row);
      }
    }
    return rows;
  }

  private List<String> row() {
    List<String> fields = new ArrayList<>();
    do {
      fields.add(peek() == '"' ? quoted() : plain());
    } while (skip(','));
    skip('\r');
    skip('\n');
    return fields;
  }

  private String plain() {
    int from = at;
    while (at < text.length() && ",\r\n".indexOf(text.charAt(at)) < 0) {
      at++;
    }
    return text.substring(from, at).trim();
  }

  private String quoted() {
    StringBuilder field = new StringBuilder();
    at++;
    while (at < text.length()) {
      char c = text.charAt(at++);
      if (c != '"') {
        field.append(c);
      } else if (!skip('"')) {
        break;
      } else {
        field.append('"');
      }
    }
    plain();
    return field.toString();
  }

  private char peek() {
    return at < text.length() ? text.charAt(at) : '\n';
  }

  private boolean skip(char c) {
    boolean there = at < text.length() && text.charAt(at) == c;
    at += there ? 1 : 0;
    return there;
  }
}
