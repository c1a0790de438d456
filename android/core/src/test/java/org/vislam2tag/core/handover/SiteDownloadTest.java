package org.vislam2tag.core.handover;

import static org.junit.Assert.assertArrayEquals;
import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;
import static org.junit.Assert.fail;

import com.sun.net.httpserver.HttpExchange;
import com.sun.net.httpserver.HttpServer;
import java.io.File;
import java.io.IOException;
import java.net.InetAddress;
import java.net.InetSocketAddress;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import javax.net.SocketFactory;
import org.junit.After;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.handover.UploadException.Cause;
import org.vislam2tag.core.site.Site;
import org.vislam2tag.core.site.SiteFloor;
import org.vislam2tag.core.site.SiteStore;

public class SiteDownloadTest {
  private static final String TOKEN = "ABCDEFGHIJKL2345";
  private static final String TOLD = "{\"name\": \"Hauptgeb\u00e4ude\", \"floors\": ["
      + "{\"number\": -1, \"name\": \"\", \"extent_m\": null, \"plan\": false}, "
      + "{\"number\": 0, \"name\": \"EG\", \"extent_m\": [-2.5, 60, 0, 30.25], \"plan\": true}, "
      + "{\"number\": 1, \"name\": \"\", \"extent_m\": [0, 60.0, 0, 30.0], \"plan\": true}]}";

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();
  private final byte[] picture = {1, 2, 3};
  private int status = 200;
  private String told = TOLD;
  private String answersWith = TOKEN;
  private HttpServer computer;
  private SiteStore store;

  @Before public void listen() throws IOException {
    store = new SiteStore(new File(temporary.getRoot(), "site"));
    computer = HttpServer.create(new InetSocketAddress(InetAddress.getLoopbackAddress(), 0), 0);
    computer.createContext("/v2/survey", call -> answer(call, status, told.getBytes(StandardCharsets.UTF_8)));
    computer.createContext("/v2/plans/0", call -> answer(call, 200, picture));
    computer.createContext("/v2/plans/1", call -> answer(call, 404, new byte[] {'{', '}'}));
    computer.start();
  }

  @After public void hangUp() {
    computer.stop(0);
  }

  private void answer(HttpExchange call, int with, byte[] body) throws IOException {
    String[] shown = call.getRequestHeaders().getFirst("Authorization").split(" ");
    String path = call.getRequestURI().getPath();
    assertEquals(Proof.ofRequest(TOKEN, "GET", path, "", "", Sha256.of(new byte[0]), shown[1]), shown[2]);
    call.getResponseHeaders().add("Upload-Answer-MAC", Proof.ofAnswer(answersWith, shown[1], with, body));
    call.sendResponseHeaders(with, body.length);
    call.getResponseBody().write(body);
    call.close();
  }

  private Site take() throws UploadException, IOException {
    Receiver receiver = Receiver.ofWords("127.0.0.1:" + computer.getAddress().getPort(), TOKEN);
    return new SiteDownload(receiver, SocketFactory.getDefault()).into(store);
  }

  private void failsWith(Cause cause) throws IOException {
    try {
      take();
      fail("taken");
    } catch (UploadException e) {
      assertEquals(cause, e.reason);
    }
  }

  @Test public void theBuildingIsTakenWithItsPlansAndKept() throws Exception {
    take();
    Site site = store.site();
    assertEquals("Hauptgeb\u00e4ude", site.name);
    assertEquals("[-1, 0, EG, 1]", site.floors.toString());
    SiteFloor ground = site.floor(0);
    assertArrayEquals(new double[] {-2.5, 60, 0, 30.25}, new double[] {ground.leftM, ground.rightM, ground.lowM, ground.highM}, 0);
    assertArrayEquals(picture, Files.readAllBytes(store.plan(ground).toPath()));
    assertNull(store.plan(site.floor(1))); // the computer could not draw it
    assertNull(store.plan(site.floor(-1)));
    assertTrue(site.floor(77).rightM > 0 && !site.floor(77).hasPlan);
  }

  @Test public void anotherBuildingReplacesItWhole() throws Exception {
    take();
    told = "{\"name\": \"B\", \"floors\": [{\"number\": 0, \"name\": \"\", \"extent_m\": [0, 9, 0, 9], \"plan\": false}]}";
    take();
    assertEquals("B", store.site().name);
    assertArrayEquals(new String[] {"site.json"}, new File(temporary.getRoot(), "site").list());
    store.forget();
    assertNull(store.site());
  }

  @Test public void whatIsNotFromTheComputerOrNotUnderstoodChangesNothing() throws Exception {
    take();
    status = 401;
    failsWith(Cause.WRONG_TOKEN);
    status = 404;
    failsWith(Cause.NOT_UNDERSTOOD);
    status = 200;
    told = "{}";
    failsWith(Cause.NOT_UNDERSTOOD);
    told = TOLD;
    answersWith = "ZZZZZZZZZZZZZZZZ";
    failsWith(Cause.NOT_UNDERSTOOD);
    computer.stop(0);
    failsWith(Cause.NO_CONNECTION);
    assertEquals(3, store.site().floors.size());
    assertFalse(store.plan(store.site().floor(0)) == null);
  }
}
