package org.vislam2tag.core.handover;

import static org.junit.Assert.assertArrayEquals;
import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;
import static org.junit.Assert.fail;

import com.sun.net.httpserver.HttpExchange;
import com.sun.net.httpserver.HttpServer;
import java.io.ByteArrayOutputStream;
import java.io.File;
import java.io.IOException;
import java.io.InputStream;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.net.ServerSocket;
import java.net.Socket;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.ArrayDeque;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Deque;
import java.util.HashSet;
import java.util.List;
import java.util.Random;
import java.util.Set;
import javax.net.SocketFactory;
import org.junit.After;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.handover.UploadException.Cause;

public class UploadTest {
  private static final String TOKEN = "ABCDEFGHIJKL2345";
  private static final int LENGTH = 10_000_000;

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();
  private final byte[] zipBytes = new byte[LENGTH];
  private final ByteArrayOutputStream kept = new ByteArrayOutputStream();
  private final List<String> requests = new ArrayList<>();
  private final List<Long> pauses = new ArrayList<>();
  private final Set<String> nonces = new HashSet<>();
  /** The token of who answers. */
  private String answersWith = TOKEN;
  /** What the computer answers before it does as it should: a status, and headers and body for some. */
  private final Deque<String> instead = new ArrayDeque<>();
  /** The computer breaks the connection after so many bytes of a body, once. */
  private int breaksAfter = Integer.MAX_VALUE;
  /** And after so many bytes of every request. */
  private int breaksEvery = Integer.MAX_VALUE;
  private HttpServer computer;
  private File zip;

  @Before public void listen() throws IOException {
    new Random(1).nextBytes(zipBytes);
    zip = temporary.newFile("s.zip");
    Files.write(zip.toPath(), zipBytes);
    computer = HttpServer.create(new InetSocketAddress(InetAddress.getLoopbackAddress(), 0), 0);
    computer.createContext("/v2/uploads/" + Sha256.of(zip), this::answer);
    computer.start();
  }

  @After public void hangUp() {
    computer.stop(0);
  }

  private void answer(HttpExchange call) throws IOException {
    String offset = header(call, "Upload-Offset");
    String[] shown = header(call, "Authorization").split(" ");
    nonces.add(shown[1]);
    assertEquals(Proof.ofRequest(TOKEN, call.getRequestMethod(), call.getRequestURI().getPath(), offset == null ? "" : offset,
        offset == null ? "" : "" + LENGTH, header(call, "Upload-Body-SHA256"), shown[1]), shown[2]);
    requests.add(call.getRequestMethod() + (offset == null ? "" : " " + offset));
    if (!instead.isEmpty()) {
      String[] words = instead.removeFirst().split(" ", 2);
      call.getResponseHeaders().add("Retry-After", "7");
      send(call, Integer.parseInt(words[0]), words.length > 1 ? words[1] : "{\"message\": \"because\"}");
      return;
    }
    if (offset != null && Integer.parseInt(offset) != kept.size()) {
      send(call, 409, state());
    } else if (take(call.getRequestBody())) {
      send(call, 200, state());
    } else {
      call.close();
    }
  }

  private static String header(HttpExchange call, String name) {
    return call.getRequestHeaders().getFirst(name);
  }

  private boolean take(InputStream body) throws IOException {
    byte[] buffer = new byte[10_000];
    int end = breaksEvery == Integer.MAX_VALUE ? breaksEvery : kept.size() + breaksEvery;
    for (int n = body.read(buffer); n >= 0; n = body.read(buffer)) {
      kept.write(buffer, 0, n);
      if (kept.size() >= end) {
        return false;
      }
      if (kept.size() >= breaksAfter) {
        breaksAfter = Integer.MAX_VALUE;
        return false;
      }
    }
    return true;
  }

  private String state() {
    boolean filed = kept.size() == LENGTH;
    return "{\"state\": \"" + (filed ? "filed" : "partial") + "\", \"received\": " + kept.size() + ", \"length\": " + LENGTH
        + ", \"session\": " + (filed ? "\"floor_4/LG/2021-12-20T132523\"" : "null") + ", \"message\": \"\"}";
  }

  private void send(HttpExchange call, int status, String body) throws IOException {
    byte[] bytes = body.getBytes(StandardCharsets.UTF_8);
    String nonce = header(call, "Authorization").split(" ")[1];
    call.getResponseHeaders().add("Upload-Answer-MAC", Proof.ofAnswer(answersWith, nonce, status, bytes));
    call.sendResponseHeaders(status, bytes.length);
    call.getResponseBody().write(bytes);
    call.close();
  }

  private String upload(Upload.Progress progress) throws Exception {
    Receiver receiver = Receiver.ofWords("127.0.0.1:" + computer.getAddress().getPort(), TOKEN);
    return new Upload(receiver, SocketFactory.getDefault(), pauses::add).send(zip, progress);
  }

  private void refused(Cause cause, String message) throws Exception {
    try {
      upload((bytes, ofBytes) -> true);
      fail("filed");
    } catch (UploadException e) {
      assertEquals(cause, e.reason);
      assertEquals(message, e.getMessage());
    }
  }

  @Test public void itSendsAllInPiecesAndTellsHowFarItIs() throws Exception {
    List<Long> told = new ArrayList<>();
    assertEquals("floor_4/LG/2021-12-20T132523", upload((bytes, ofBytes) -> told.add(bytes)));
    assertArrayEquals(zipBytes, kept.toByteArray());
    assertEquals(Arrays.asList("GET", "PATCH 0", "PATCH 4194304", "PATCH 8388608"), requests);
    assertEquals(4, nonces.size());
    assertEquals(LENGTH, (long) told.get(told.size() - 1));
    for (int i = 1; i < told.size(); i++) {
      assertTrue(told.get(i) >= told.get(i - 1));
    }
  }

  @Test public void itResumesWhereAnEarlierTryWasBrokenOff() throws Exception {
    kept.write(zipBytes, 0, 9_000_000);
    upload((bytes, ofBytes) -> true);
    assertArrayEquals(zipBytes, kept.toByteArray());
    assertEquals(Arrays.asList("GET", "PATCH 9000000"), requests);
  }

  @Test public void itResumesByItselfWhenTheConnectionBreaks() throws Exception {
    breaksAfter = 3_000_000;
    upload((bytes, ofBytes) -> true);
    assertArrayEquals(zipBytes, kept.toByteArray());
    assertEquals(Arrays.asList(1000L), pauses);
    assertEquals("GET", requests.get(2));
  }

  @Test public void aBadConnectionOnlyTakesLonger() throws Exception {
    breaksEvery = 900_000;
    upload((bytes, ofBytes) -> true);
    assertArrayEquals(zipBytes, kept.toByteArray());
    assertTrue(pauses.size() + " breaks", pauses.size() > Upload.TRIES);
  }

  @Test public void itGoesOnFromWhereTheComputerSays() throws Exception {
    instead.add("200 {\"state\": \"partial\", \"received\": 5000, \"length\": null, \"session\": null, \"message\": \"\"}");
    upload((bytes, ofBytes) -> true);
    assertEquals(Arrays.asList("GET", "PATCH 5000", "PATCH 0"), requests.subList(0, 3));
    assertArrayEquals(zipBytes, kept.toByteArray());
  }

  @Test public void whatIsFiledAlreadyIsNotSentAgain() throws Exception {
    kept.write(zipBytes, 0, LENGTH);
    upload((bytes, ofBytes) -> true);
    assertEquals(Arrays.asList("GET"), requests);
  }

  @Test public void itWaitsAsLongAsItIsTold() throws Exception {
    instead.addAll(Arrays.asList("429", "423"));
    upload((bytes, ofBytes) -> true);
    assertEquals(Arrays.asList(7000L, 7000L), pauses);
  }

  @Test public void refusalsAreToldInTheComputersWords() throws Exception {
    Object[][] refusals = {{"401", Cause.WRONG_TOKEN}, {"413", Cause.TOO_LARGE}, {"422", Cause.REFUSED}, {"507", Cause.COMPUTER_FULL},
        {"400", Cause.NOT_UNDERSTOOD}};
    for (Object[] refusal : refusals) {
      instead.add((String) refusal[0]);
      refused((Cause) refusal[1], "because");
    }
    instead.add("500 <html>");
    refused(Cause.NOT_UNDERSTOOD, "status 500");
    instead.add("200 <html>");
    refused(Cause.NOT_UNDERSTOOD, "JSON: a value expected at character 0");
    instead.add("200 {\"state\": \"partial\", \"received\": 10000001}");
    refused(Cause.NOT_UNDERSTOOD, "the computer has 10000001 bytes of 10000000");
  }

  @Test public void anotherComputersWordThatItIsFiledIsNotBelieved() throws Exception {
    kept.write(zipBytes, 0, LENGTH);
    answersWith = "ZZZZZZZZZZZZZZZZ";
    refused(Cause.NOT_UNDERSTOOD, "the answer is not from the computer that shows this token");
  }

  @Test public void anOlderProgramIsToldAsSuch() throws Exception {
    instead.add("404");
    refused(Cause.NOT_UNDERSTOOD, "the computer's program is older than this app: update it");
  }

  @Test public void itDoesNotTryForEver() throws Exception {
    int port = computer.getAddress().getPort();
    computer.stop(0);
    refused(Cause.NO_CONNECTION, "no connection to 127.0.0.1:" + port);
    assertEquals(Upload.TRIES, pauses.size());
  }

  @Test public void theCollectorMayStopIt() throws Exception {
    try {
      upload((bytes, ofBytes) -> bytes < 5_000_000);
      fail("filed");
    } catch (UploadException e) {
      assertEquals(Cause.CANCELLED, e.reason);
    }
    assertTrue(kept.size() + " bytes", kept.size() < 6_000_000);
  }

  @Test public void aComputerThatSpeaksSomethingElseIsNoCrash() throws Exception {
    String[] babble = {"", "SSH-2.0-OpenSSH\r\n", "HTTP/1.1 abc\r\n\r\n", "HTTP/1.1 200 OK\r\nContent-Length: 50\r\n\r\n{}"};
    for (String words : babble) {
      try (ServerSocket server = new ServerSocket(0, 10, InetAddress.getLoopbackAddress())) {
        Thread talker = new Thread(() -> talk(server, words));
        talker.start();
        Receiver receiver = Receiver.ofWords("127.0.0.1:" + server.getLocalPort(), TOKEN);
        new Upload(receiver, SocketFactory.getDefault(), pauses::add).send(zip, (bytes, ofBytes) -> true);
        fail(words);
      } catch (UploadException e) {
        assertEquals(Cause.NO_CONNECTION, e.reason);
      }
    }
  }

  private static void talk(ServerSocket server, String words) {
    while (true) {
      try (Socket caller = server.accept()) {
        caller.getOutputStream().write(words.getBytes(StandardCharsets.US_ASCII));
      } catch (IOException e) {
        return;
      }
    }
  }
}
