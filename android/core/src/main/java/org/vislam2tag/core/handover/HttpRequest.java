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

  private static final String OFFSET = "Upload-Offset";
  private static final String LENGTH = "Upload-Length";

  private final Receiver receiver;
  private final String method;
  private final String path;
  private final String nonce = Proof.nonce();
  private final Map<String, String> headers = new LinkedHashMap<>();
  private Body body = out -> {};
  private String bodySha = Sha256.of(new byte[0]);

  HttpRequest(Receiver receiver, String method, String path) {
    this.receiver = receiver;
    this.method = method;
    this.path = path;
    headers.put("Host", receiver.address());
    headers.put("Connection", "close");
  }

  /** A piece of an upload: {@code length} bytes with this SHA-256, from {@code offset} on, of {@code whole}. */
  HttpRequest body(long offset, long length, long whole, String sha256, Body writer) {
    body = writer;
    bodySha = sha256;
    headers.put("Content-Type", "application/octet-stream");
    headers.put("Content-Length", Long.toString(length));
    headers.put(OFFSET, Long.toString(offset));
    headers.put(LENGTH, Long.toString(whole));
    return this;
  }

  /** Is an answer from the computer that knows the token? */
  boolean isAnsweredBy(HttpAnswer answer) {
    return Proof.isSame(answer.header("upload-answer-mac"), Proof.ofAnswer(receiver.token, nonce, answer.status, answer.bytes));
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
    String offset = headers.getOrDefault(OFFSET, "");
    String length = headers.getOrDefault(LENGTH, "");
    headers.put("Upload-Body-SHA256", bodySha);
    headers.put("Authorization",
        "Vislam2tag " + nonce + " " + Proof.ofRequest(receiver.token, method, path, offset, length, bodySha, nonce));
    StringBuilder text = new StringBuilder(method).append(" ").append(path).append(" HTTP/1.1\r\n");
    headers.forEach((name, value) -> text.append(name).append(": ").append(value).append("\r\n"));
    return text.append("\r\n").toString();
  }
}
