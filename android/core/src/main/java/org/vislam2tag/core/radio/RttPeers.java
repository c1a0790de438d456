package org.vislam2tag.core.radio;

import java.util.ArrayList;
import java.util.List;
import java.util.function.Predicate;
import java.util.function.ToIntFunction;

/** Which of the access points that a scan heard are asked for a range: the platform takes a few at a time only. */
public final class RttPeers {
  private RttPeers() {}

  /**
   * Those that answer ranging first, then, where the platform can ask them ({@code others}), those that do not; of each the
   * loudest first; {@code most} at most.
   */
  public static <A> List<A> choose(List<A> heard, ToIntFunction<A> rssiDbm, Predicate<A> answers, boolean others, int most) {
    List<A> peers = new ArrayList<>(heard);
    peers.removeIf(point -> !others && !answers.test(point));
    peers.sort((one, other) -> answers.test(one) == answers.test(other)
        ? Integer.compare(rssiDbm.applyAsInt(other), rssiDbm.applyAsInt(one)) : answers.test(one) ? -1 : 1);
    return peers.subList(0, Math.min(most, peers.size()));
  }
}
