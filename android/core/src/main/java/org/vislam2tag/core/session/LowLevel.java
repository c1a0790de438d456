package org.vislam2tag.core.session;

/** Notices when a level (space, charge) falls low; again only after it had risen well above. */
final class LowLevel {
  private static final double RISEN = 1.25;

  private final long threshold;
  private boolean low;

  LowLevel(long threshold) {
    this.threshold = threshold;
  }

  /** True when the level has just become low. */
  boolean falls(long level) {
    boolean before = low;
    low = level <= threshold || before && level < threshold * RISEN;
    return low && !before;
  }
}
