package org.vislam2tag.core.handover;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;
import static org.junit.Assert.fail;

import java.io.File;
import java.io.IOException;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.handover.UploadException.Cause;

public class SendAllTest {
  private static final Receiver COMPUTER = Receiver.ofWords("[fe80::1]:8765", "abcd-efgh-ijkl-2345");

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();
  private final List<String> asked = new ArrayList<>();
  private File kept;
  private Outbox outbox;
  private long waitedMs;

  @Before public void threeWait() throws IOException {
    kept = new File(temporary.getRoot(), "outbox.json");
    outbox = new Outbox(kept);
    outbox.send(COMPUTER, Arrays.asList("a", "b", "c"));
  }

  private SendAll sending(Outbox from, SendAll.Courier courier) {
    return new SendAll(from, (to, session) -> {
      asked.add(session);
      return courier.send(to, session);
    }, time -> waitedMs += time);
  }

  @Test public void allAreSentInTheirOrderAndMarked() throws Exception {
    sending(outbox, (to, session) -> "floor_4/LG/" + session + to.address()).run();
    assertEquals(Arrays.asList("a", "b", "c"), asked);
    for (Outbox each : new Outbox[] {outbox, new Outbox(kept)}) {
      assertEquals("floor_4/LG/b[fe80::1]:8765", each.filedAt("b"));
      assertTrue(each.waiting().isEmpty());
      assertNull(each.receiver());
    }
    assertTrue("no token is kept that nobody needs", !new String(Files.readAllBytes(kept.toPath())).contains("ABCDEFGH"));
  }

  @Test public void aComputerOutOfReachIsWaitedFor() throws Exception {
    sending(outbox, (to, session) -> {
      if (asked.size() < 6) {
        throw new UploadException(Cause.NO_CONNECTION, "no connection");
      }
      return session;
    }).run();
    assertEquals(Arrays.asList("a", "a", "a", "a", "a", "a", "b", "c"), asked);
    assertEquals((5 + 10 + 20 + 40 + 60) * 1000, waitedMs);
  }

  @Test public void oneThatIsRefusedDoesNotKeepTheOthers() throws Exception {
    sending(outbox, (to, session) -> {
      if (session.equals("b")) {
        throw new UploadException(Cause.REFUSED, "checksum");
      }
      return session.equals("c") ? null : session; // the last was deleted meanwhile
    }).run();
    assertEquals("a", outbox.filedAt("a"));
    assertEquals("checksum", new Outbox(kept).refusal("b"));
    assertNull(outbox.filedAt("c"));
    assertTrue(outbox.waiting().isEmpty());
  }

  @Test public void whatWaitsIsSentAfterTheAppWasEnded() throws Exception {
    SendAll first = sending(outbox, (to, session) -> {
      if (session.equals("b")) {
        throw new IllegalStateException("killed");
      }
      return session;
    });
    try {
      first.run();
      fail("ran on");
    } catch (IllegalStateException e) {
      assertEquals(Arrays.asList("a", "b"), asked);
    }
    asked.clear();
    Outbox again = new Outbox(kept);
    sending(again, (to, session) -> session + to.token).run();
    assertEquals(Arrays.asList("b", "c"), asked);
    assertEquals("cABCDEFGHIJKL2345", again.filedAt("c"));
  }

  @Test public void anotherTokenEndsItAndWhatWaitsStays() throws Exception {
    try {
      sending(outbox, (to, session) -> {
        throw new UploadException(Cause.WRONG_TOKEN, "another token");
      }).run();
      fail("ran on");
    } catch (UploadException e) {
      assertEquals(Cause.WRONG_TOKEN, e.reason);
    }
    assertEquals(Arrays.asList("a", "b", "c"), new Outbox(kept).waiting());
  }

  @Test public void stoppedItBeginsNoOther() throws Exception {
    SendAll[] sender = new SendAll[1];
    sender[0] = sending(outbox, (to, session) -> {
      sender[0].stop();
      throw new UploadException(Cause.CANCELLED, "stopped");
    });
    sender[0].run();
    assertEquals(Collections.singletonList("a"), asked);
    assertEquals(3, outbox.waiting().size());
    outbox.cancel();
    assertTrue(new Outbox(kept).waiting().isEmpty());
  }

  @Test public void aSessionThatIsDeletedIsForgotten() throws Exception {
    sending(outbox, (to, session) -> session).run();
    outbox.forget("a");
    assertNull(new Outbox(kept).filedAt("a"));
    assertEquals("b", new Outbox(kept).filedAt("b"));
  }

  @Test public void aBrokenFileHoldsNothing() throws Exception {
    Files.write(kept.toPath(), "{\"waiting\": [\"a\", ".getBytes());
    assertTrue(new Outbox(kept).waiting().isEmpty());
    assertNull(new Outbox(kept).receiver());
  }
}
