package org.vislam2tag.core.radio;

import static org.junit.Assert.assertEquals;

import java.util.Arrays;
import java.util.List;
import org.junit.Test;

public class RttPeersTest {
  private static final List<String> HEARD = Arrays.asList("-70", "-50 responder", "-40", "-60 responder", "-90 responder");

  private static List<String> chosen(boolean others, int most) {
    return RttPeers.choose(HEARD, point -> Integer.parseInt(point.split(" ")[0]), point -> point.endsWith("responder"), others, most);
  }

  @Test public void theLoudestThatAnswerComeFirst() {
    assertEquals(Arrays.asList("-50 responder", "-60 responder", "-90 responder", "-40"), chosen(true, 4));
    assertEquals(5, chosen(true, 10).size());
  }

  @Test public void othersAreAskedOnlyWhereThePlatformCan() {
    assertEquals(Arrays.asList("-50 responder", "-60 responder"), chosen(false, 2));
    assertEquals(3, chosen(false, 10).size());
  }
}
