package org.vislam2tag.app.setup;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNotEquals;

import java.util.LinkedHashMap;
import java.util.Map;
import org.junit.Test;
import org.vislam2tag.app.R;
import org.vislam2tag.app.setup.ScanFacts.State;

public class ScanFactsTest {
  private final ScanFacts facts = new ScanFacts();

  private Map<Integer, State> states() {
    Map<Integer, State> states = new LinkedHashMap<>();
    facts.steps(step -> states.put(step.sentence, step.state));
    return states;
  }

  @Test public void aPhoneAsItComesHasAllOfItToDo() {
    facts.api = 34;
    facts.scansThrottled = true;
    facts.batterySaver = true;
    Map<Integer, State> states = states();
    assertEquals(State.NOT_TOLD, states.remove(R.string.unlock_other_maker));
    assertEquals(7, states.size());
    states.forEach((sentence, state) -> assertEquals(State.TO_DO, state));
  }

  @Test public void whatIsDoneIsTold() {
    facts.api = 30;
    facts.locationAllowed = facts.locationOn = facts.wifiOn = facts.unrestricted = true;
    Map<Integer, State> states = states();
    assertEquals("the switch is off: nobody need look for it", State.DONE, states.get(R.string.unlock_developer));
    assertEquals(State.DONE, states.get(R.string.unlock_throttling));
    assertEquals(State.DONE, states.get(R.string.unlock_saver));
  }

  @Test public void olderVersionsDoNotTellOrHaveNoSwitch() {
    facts.api = 29;
    assertEquals(State.NOT_TOLD, states().get(R.string.unlock_throttling));
    facts.api = 28;
    assertEquals(State.TO_DO, states().get(R.string.unlock_android_9));
    facts.api = 27; // does not throttle
    assertEquals(null, states().get(R.string.unlock_android_9));
    assertEquals(null, states().get(R.string.unlock_throttling));
  }

  @Test public void eachMakerHasItsOwnPage() {
    int usual = R.string.unlock_other_maker;
    for (String maker : new String[] {"samsung", "Xiaomi", "HUAWEI", "OnePlus"}) {
      facts.maker = maker;
      assertEquals(State.NOT_TOLD, states().values().toArray()[states().size() - 1]);
      assertNotEquals(maker, State.NOT_TOLD, states().get(usual));
    }
  }
}
