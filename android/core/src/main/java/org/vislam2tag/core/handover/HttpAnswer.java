package org.vislam2tag.core.handover;

import java.io.ByteArrayOutputStream;
import java.io.IOException;
import java.io.InputStream;
import java.nio.charset.StandardCharsets;
import java.util.HashMap;
import java.util.Locale;
import java.util.Map;

/** A server's answer: status, headers, body as text. */
final class HttpAnswer {
  private static final int MOST_LINE = 8 << 10;
  private static final int MOST_HEADERS = 100;
  private static final int MOST_BODY = 16 << 20;

  final int status;
  final byte[] bytes;
  final String body;
  private final Map<String, String> headers;

  private HttpAnswer(int status, Map<String, String> headers, byte[] bytes) {
    this.status = status;
    this.headers = headers;
    this.bytes = bytes;
    body = new String(bytes, StandardCharsets.UTF_8);
  }

  /**
   * Reads an answer of HTTP/1.0 or 1.1.
   *
   * @throws IOException if the connection breaks off, or it is no answer that we understand
   */
  static HttpAnswer read(InputStream in) throws IOException {
    String[] first = line(in).split(" ", 3);
    if (first.length < 2 || !first[0].startsWith("HTTP/1.") || !first[1].matches("[0-9]{3}")) {
      throw new IOException("no HTTP answer: " + String.join(" ", first));
    }
    Map<String, String> headers = headers(in);
    return new HttpAnswer(Integer.parseInt(first[1]), headers, body(in, headers.get("content-length")));
  }

  /** A header's value; null where there is none. */
  String header(String name) {
    return headers.get(name);
  }

  /** A header's value as a whole number; {@code other} where there is none. */
  long number(String header, long other) {
    String value = headers.get(header);
    return value != null && value.matches("[0-9]{1,9}") ? Long.parseLong(value) : other;
  }

  private static Map<String, String> headers(InputStream in) throws IOException {
    Map<String, String> headers = new HashMap<>();
    for (String line = line(in); !line.isEmpty(); line = line(in)) {
      int colon = line.indexOf(':');
      if (colon > 0) {
        headers.put(line.substring(0, colon).toLowerCase(Locale.ROOT), line.substring(colon + 1).trim());
      }
      if (headers.size() > MOST_HEADERS) {
        throw new IOException("too many headers");
      }
    }
    return headers;
  }

  private static String line(InputStream in) throws IOException {
    ByteArrayOutputStream line = new ByteArrayOutputStream();
    for (int b = in.read(); b != '\n'; b = in.read()) {
      if (b < 0 || line.size() > MOST_LINE) {
        throw new IOException("the answer broke off");
      }
      if (b != '\r') {
        line.write(b);
      }
    }
    return new String(line.toByteArray(), StandardCharsets.ISO_8859_1);
  }

  /** As long as told, else to the end of the connection. */
  private static byte[] body(InputStream in, String length) throws IOException {
    boolean told = length != null && length.matches("[0-9]{1,9}");
    int most = told ? Math.min(Integer.parseInt(length), MOST_BODY) : MOST_BODY;
    ByteArrayOutputStream body = new ByteArrayOutputStream();
    while (body.size() < most) {
      int b = in.read();
      if (b < 0 && told) {
        throw new IOException("the answer broke off");
      }
      if (b < 0) {
        break;
      }
      body.write(b);
    }
    return body.toByteArray();
  }
}
