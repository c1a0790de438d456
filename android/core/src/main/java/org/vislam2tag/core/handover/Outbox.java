package org.vislam2tag.core.handover;

import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.LinkedHashSet;
import java.util.List;
import java.util.Map;
import java.util.Set;
import org.vislam2tag.core.json.JsonReader;
import org.vislam2tag.core.json.JsonWriter;
import org.vislam2tag.core.json.WholeFile;

/**
 * Which sessions wait to be sent, to which computer, and which were filed where: kept in a file, so that sending goes on after
 * the app was ended, and what was sent stays marked. From any thread.
 */
public final class Outbox {
  private final File file;
  private String link = "";
  private final Set<String> waiting = new LinkedHashSet<>();
  private final Map<String, String> filed = new LinkedHashMap<>();
  private final Map<String, String> refused = new LinkedHashMap<>();

  /** What is kept in this file; nothing where there is none that can be read. */
  public Outbox(File file) {
    this.file = file;
    try {
      Map<String, Object> json = JsonReader.readObject(new String(Files.readAllBytes(file.toPath()), StandardCharsets.UTF_8));
      link = json.get("link") instanceof String ? (String) json.get("link") : "";
      if (json.get("waiting") instanceof List) {
        ((List<?>) json.get("waiting")).forEach(name -> waiting.add(String.valueOf(name)));
      }
      take(json.get("filed"), filed);
      take(json.get("refused"), refused);
    } catch (IOException e) {
      waiting.clear();
    }
  }

  /** These sessions are to be sent to this computer, and all that wait still. */
  public synchronized void send(Receiver to, List<String> sessions) throws IOException {
    link = to.link();
    waiting.addAll(sessions);
    keep();
  }

  /** Nothing waits any more. */
  public synchronized void cancel() throws IOException {
    waiting.clear();
    keep();
  }

  /** The computer that sessions wait for; null where none does. */
  public synchronized Receiver receiver() {
    return waiting.isEmpty() ? null : Receiver.ofLink(link);
  }

  /** The sessions that wait, in their order. */
  public synchronized List<String> waiting() {
    return new ArrayList<>(waiting);
  }

  /** Where the computer filed a session; null where it was not sent. */
  public synchronized String filedAt(String session) {
    return filed.get(session);
  }

  /** Why the computer refused a session; null where it did not. */
  public synchronized String refusal(String session) {
    return refused.get(session);
  }

  /** The computer filed a session. */
  synchronized void filed(String session, String where) throws IOException {
    waiting.remove(session);
    refused.remove(session);
    filed.put(session, where);
    keep();
  }

  /** The computer refused a session: asking again does not help. */
  synchronized void refused(String session, String why) throws IOException {
    waiting.remove(session);
    refused.put(session, why);
    keep();
  }

  /** A session is not on the phone any more. */
  public synchronized void forget(String session) throws IOException {
    if (waiting.remove(session) | filed.remove(session) != null | refused.remove(session) != null) {
      keep();
    }
  }

  private static void take(Object from, Map<String, String> into) {
    if (from instanceof Map) {
      ((Map<?, ?>) from).forEach((session, words) -> into.put(String.valueOf(session), String.valueOf(words)));
    }
  }

  private void keep() throws IOException {
    Map<String, Object> json = new LinkedHashMap<>();
    json.put("link", waiting.isEmpty() ? "" : link);
    json.put("waiting", new ArrayList<>(waiting));
    json.put("filed", filed);
    json.put("refused", refused);
    WholeFile.write(file, JsonWriter.write(json));
  }
}
