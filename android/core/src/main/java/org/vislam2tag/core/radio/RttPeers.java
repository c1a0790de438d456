package org.vislam2tag.core.radio;

import java.util.ArrayList;
import java.util.Comparator;
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
    peers.sort(Comparator.comparing((A point) -> !answers.test(point)).thenComparing(Comparator.comparingInt(rssiDbm).reversed()));
    return peers.subList(0, Math.min(most, peers.size()));
  }
}
