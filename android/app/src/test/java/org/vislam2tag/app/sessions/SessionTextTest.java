package org.vislam2tag.app.sessions;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertThrows;
import static org.junit.Assert.assertTrue;

import java.util.Arrays;
import java.util.HashSet;
import java.util.Set;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.R;
import org.vislam2tag.app.Recorded;
import org.vislam2tag.app.record.EndText;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.session.EndState;
import org.vislam2tag.core.session.SessionStore;

public class SessionTextTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final SessionText text = new SessionText((id, parts) -> id + Arrays.toString(parts));

  @Test public void aSessionTellsHowItEnded() throws Exception {
    new Recorded(folder.getRoot()).recorder.stop();
    String words = text.of(new SessionStore(folder.getRoot()).list(null).get(0));
    assertTrue(words, words.contains(R.string.end_stopped + "["));
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
