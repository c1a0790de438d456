package org.vislam2tag.app.sessions;

import java.lang.reflect.Field;

/** What waits to be sent is one for the process, which all tests share. */
public final class Outboxes {
  private Outboxes() {}

  /** The next that asks has one of its own. */
  public static void forget() throws ReflectiveOperationException {
    Field outbox = UploadService.class.getDeclaredField("outbox");
    outbox.setAccessible(true);
    outbox.set(null, null);
  }
}
