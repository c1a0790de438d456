package org.vislam2tag.core.walk;

import java.util.EnumSet;
import java.util.Set;

/** Which warnings are on. One that is on goes off a little below where it came on, so that it does not flicker. */
public final class Warnings {
  /** A warning goes off below this share of its threshold. */
  private static final double OFF = 0.8;

  private final WarningSettings settings;
  private final Set<Warning> on = EnumSet.noneOf(Warning.class);

  public Warnings(WarningSettings settings) {
    this.settings = settings;
  }

  /**
   * Looks at the walk again and tells which warnings came on by that.
   *
   * @param lostS for how long tracking has been lost, s; 0 while it is not
   */
  public Set<Warning> update(double sinceLandmarkS, double sinceLandmarkM, double lostS, double speedMps, double turningRadps) {
    Set<Warning> before = EnumSet.copyOf(on);
    set(Warning.NO_LANDMARK, Math.max(sinceLandmarkS / settings.noLandmarkS, sinceLandmarkM / settings.noLandmarkM));
    set(Warning.TRACKING, lostS / settings.lostS);
    set(Warning.TOO_FAST, Math.max(speedMps / settings.fastestMps, turningRadps / settings.fastestRadps));
    Set<Warning> news = EnumSet.copyOf(on);
    news.removeAll(before);
    return news;
  }

  /** The warnings that are on now. */
  public Set<Warning> on() {
    return EnumSet.copyOf(on);
  }

  private void set(Warning warning, double share) {
    if (share >= 1) {
      on.add(warning);
    } else if (share < OFF) {
      on.remove(warning);
    }
  }
}
