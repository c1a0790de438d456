package org.vislam2tag.app.sessions;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertThrows;
import static org.junit.Assert.assertTrue;

import java.io.File;
import java.util.Arrays;
import java.util.Collections;
import java.util.HashSet;
import java.util.Set;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.R;
import org.vislam2tag.app.Recorded;
import org.vislam2tag.app.record.EndText;
import org.vislam2tag.core.handover.Outbox;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.SendAll;
import org.vislam2tag.core.session.EndState;
import org.vislam2tag.core.session.SessionStore;
import org.vislam2tag.core.session.StoredSession;

public class SessionTextTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final SessionText text = new SessionText((id, parts) -> id + Arrays.toString(parts));

  @Test public void aSessionTellsHowItEnded() throws Exception {
    new Recorded(folder.getRoot()).recorder.stop();
    StoredSession session = new SessionStore(folder.getRoot()).list(null).get(0);
    Outbox outbox = new Outbox(new File(folder.getRoot(), "outbox.json"));
    String words = text.of(session, outbox);
    assertTrue(words, words.startsWith(R.string.session_where + "[0, ")); // no building was named
    assertTrue(words, words.contains(R.string.end_stopped + "["));
    assertFalse(words.contains(Integer.toString(R.string.waits_to_be_sent)));
    outbox.send(Receiver.ofWords("10.0.0.2:8765", "ABCDEFGHIJKL2345"), Collections.singletonList(session.folder.getName()));
    assertTrue(text.of(session, outbox).endsWith("\n" + R.string.waits_to_be_sent + "[]"));
    new SendAll(outbox, (to, name) -> "floor_4/LG/" + name).run();
    assertTrue(text.of(session, outbox).endsWith(R.string.sent_to + "[floor_4/LG/" + session.folder.getName() + "]"));
  }

  @Test public void everyEndHasASentence() {
    Set<Integer> sentences = new HashSet<>();
    for (EndState state : EndState.values()) {
      assertTrue(state.name(), sentences.add(EndText.sentence(state.word())));
    }
  }

  @Test public void aLinkOrAddressAndTokenNameTheComputer() {
    Receiver byLink = Receivers.of("vislam2tag://192.168.1.5:8765/#ABCDEFGHIJKLMNOP", "");
    Receiver byWords = Receivers.of("192.168.1.5:8765", "abcd-efgh-ijkl-mnop");
    assertEquals(byLink.address(), byWords.address());
    assertThrows(IllegalArgumentException.class, () -> Receivers.of("192.168.1.5", "ABCD"));
  }
}
