package org.vislam2tag.core.session;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;

import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.Map;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;

public class SessionStoreTest {
  private static final String JSON = "{\"format\": \"vislam2tag-phone\", \"version\": 1, \"site\": \"Haus\", \"floor\": -1, \"device\": \"LG\","
      + " \"note\": \"\", \"start\": {\"boot_ns\": 5000000000}, \"end\": %s, \"later\": [1]}";
  private static final String STOPPED = "{\"state\": \"stopped\", \"detail\": \"\", \"boot_ns\": 65500000000}";

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();

  private File session(String name, String json) throws IOException {
    File folder = temporary.newFolder(name);
    write(folder, "session.json", json);
    return folder;
  }

  private static void write(File folder, String name, String text) throws IOException {
    Files.write(new File(folder, name).toPath(), text.getBytes(StandardCharsets.UTF_8));
  }

  private static String read(File folder, String name) throws IOException {
    return new String(Files.readAllBytes(new File(folder, name).toPath()), StandardCharsets.UTF_8);
  }

  private SessionStore store() {
    return new SessionStore(temporary.getRoot());
  }

  @Test public void sessionsAreListedNewestFirstWithWhatIsKnown() throws IOException {
    session("2021-12-20T132523", String.format(JSON, STOPPED));
    session("2021-12-21T132523", "broken");
    File open = session("2021-12-22T132523-2", String.format(JSON, "null"));
    temporary.newFolder("other");
    temporary.newFile("2021-12-23T132523");
    List<StoredSession> list = store().list(open);
    assertEquals(2, list.size());
    assertEquals("2021-12-21T132523", list.get(0).folder.getName());
    assertEquals("", list.get(0).end);
    assertTrue(Double.isNaN(list.get(0).durationS));
    StoredSession known = list.get(1);
    assertEquals("Haus -1 LG stopped", known.site + " " + known.floor + " " + known.device + " " + known.end);
    assertEquals(60.5, known.durationS, 0);
    assertEquals(String.format(JSON, STOPPED).length(), known.bytes);
    assertEquals(3, store().list(null).size());
  }

  @Test public void aMissingFolderHoldsNoSessions() throws IOException {
    SessionStore store = new SessionStore(new File(temporary.getRoot(), "none"));
    assertEquals(Collections.emptyList(), store.list(null));
    assertEquals(Collections.emptyList(), store.recover(null));
  }

  @Test public void killedSessionsAreFinishedAndOthersLeftAlone() throws IOException {
    File killed = session("2021-12-20T132523", String.format(JSON, "null"));
    File stopped = session("2021-12-20T132524", String.format(JSON, STOPPED));
    File open = session("2021-12-20T132525", String.format(JSON, "null"));
    write(killed, "WiFi.csv", "time_ns\n1\n2\n33");
    write(killed, "Ble.csv", "time_");
    write(killed, "session.json.tmp", "{");
    write(stopped, "WiFi.csv", "time_ns\n1\n2\n33");
    assertEquals(Collections.singletonList(killed), store().recover(open));
    assertEquals("time_ns\n1\n2\n", read(killed, "WiFi.csv"));
    assertEquals("", read(killed, "Ble.csv"));
    assertEquals("time_ns\n1\n2\n33", read(stopped, "WiFi.csv"));
    assertEquals(String.format(JSON, STOPPED), read(stopped, "session.json"));
    assertEquals(String.format(JSON, "null"), read(open, "session.json"));
    Map<String, Object> json = SessionFiles.readJson(killed);
    assertEquals("{state=killed, detail=, wall=null, wall_ms=null, boot_ns=null, nano_ns=null}", json.get("end").toString());
    assertEquals("what is not ours is kept", Collections.singletonList(1L), json.get("later"));
    assertFalse(Arrays.asList(killed.list()).contains("session.json.tmp"));
  }

  @Test public void aFolderWithoutAnythingInItIsRemoved() throws IOException {
    File empty = temporary.newFolder("2021-12-20T132523");
    store().recover(null);
    assertFalse(empty.exists());
  }

  @Test public void deletingTakesTheWholeFolder() throws IOException {
    File folder = session("2021-12-20T132523", String.format(JSON, STOPPED));
    write(folder, "WiFi.csv", "time_ns\n");
    store().delete(store().list(null).get(0));
    assertFalse(folder.exists());
  }
}
