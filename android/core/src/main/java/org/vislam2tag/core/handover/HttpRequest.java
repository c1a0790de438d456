package org.vislam2tag.core.handover;

import java.io.BufferedInputStream;
import java.io.IOException;
import java.io.InputStream;
import java.io.OutputStream;
import java.net.InetSocketAddress;
import java.net.Socket;
import java.nio.charset.StandardCharsets;
import java.util.LinkedHashMap;
import java.util.Map;
import javax.net.SocketFactory;

/**
 * One HTTP request on a connection of its own. Java's HttpURLConnection knows no PATCH, and Android's forbids plain HTTP,
 * which is what a computer in the local network without a certificate can speak.
 */
final class HttpRequest {
  private static final int CONNECT_MS = 5_000;
  /** The answer to the last bytes comes after the computer has checked all of the zip. */
  private static final int ANSWER_MS = 180_000;

  /** Writes a request's body. */
  interface Body {
    void write(OutputStream out) throws IOException;
  }

  private final Receiver receiver;
  private final String first;
  private final Map<String, String> headers = new LinkedHashMap<>();
  private Body body = out -> {};

  HttpRequest(Receiver receiver, String method, String path) {
    this.receiver = receiver;
    first = method + " " + path + " HTTP/1.1";
    header("Host", receiver.address());
    header("Authorization", "Bearer " + receiver.token);
    header("Connection", "close");
  }

  HttpRequest header(String name, String value) {
    headers.put(name, value);
    return this;
  }

  HttpRequest body(long length, Body writer) {
    body = writer;
    return header("Content-Length", Long.toString(length));
  }

  /** Sends it and waits for the answer; throws an IOException where the connection fails. */
  HttpAnswer send(SocketFactory sockets) throws IOException {
    try (Socket socket = sockets.createSocket()) {
      socket.connect(new InetSocketAddress(receiver.host, receiver.port), CONNECT_MS);
      socket.setSoTimeout(ANSWER_MS);
      InputStream in = new BufferedInputStream(socket.getInputStream());
      IOException broken = write(socket.getOutputStream());
      try {
        return HttpAnswer.read(in);
      } catch (IOException e) {
        throw broken == null ? e : broken;
      }
    }
  }

  /** A server that refuses answers before it has all; the answer can be there though the writing failed. */
  private IOException write(OutputStream out) {
    try {
      out.write(head().getBytes(StandardCharsets.ISO_8859_1));
      body.write(out);
      out.flush();
      return null;
    } catch (IOException e) {
      return e;
    }
  }

  private String head() {
    StringBuilder text = new StringBuilder(first).append("\r\n");
    headers.forEach((name, value) -> text.append(name).append(": ").append(value).append("\r\n"));
    return text.append("\r\n").toString();
  }
}
