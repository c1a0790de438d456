package org.vislam2tag.core.handover;

import java.io.IOException;
import java.util.Map;
import org.vislam2tag.core.json.JsonReader;

/** What the computer says of an upload. */
final class UploadState {
  final boolean filed;
  /** Bytes that it keeps. */
  final long received;
  /** Where it filed the session; null unless filed. */
  final String session;
  /** One sentence for the screen; may be empty. */
  final String message;

  private UploadState(Map<String, Object> json) {
    filed = "filed".equals(json.get("state"));
    received = json.get("received") instanceof Long ? (Long) json.get("received") : -1;
    session = json.get("session") instanceof String ? (String) json.get("session") : null;
    message = json.get("message") instanceof String ? (String) json.get("message") : "";
  }

  static UploadState of(HttpAnswer answer) throws IOException {
    return new UploadState(JsonReader.readObject(answer.body));
  }

  /** The message of a refusal, whatever its body is. */
  static String message(HttpAnswer answer) {
    try {
      String message = of(answer).message;
      return message.isEmpty() ? "status " + answer.status : message;
    } catch (IOException e) {
      return "status " + answer.status;
    }
  }
}
