package org.vislam2tag.core.walk;

/** A part of the walk without a landmark, and how far off positions in it are expected to be where they are worst. */
public final class Stretch {
  /** Drift of usual trackers as {@code smoother.noise.USUAL} of the computer's program has it: m and rad per square root of a metre. */
  static final double POSITION = 0.016;
  static final double HEADING = 0.0015;
  /** A landmark's sighting, m. */
  static final double SIGHTING_M = 0.14;

  /** Its length, m. */
  public final double metres;
  /** The landmark before it; null at the start of the walk. */
  public final String from;
  /** The landmark after it; null at the end so far. */
  public final String to;

  Stretch(double metres, String from, String to) {
    this.metres = metres;
    this.from = from;
    this.to = to;
  }

  /**
   * Standard deviation per axis where it is greatest, m: between two landmarks in the middle (a random walk of the position tied at
   * both ends has a quarter of its variance there, one of the heading L^3/48), beyond the last one at the end (all of it, and L^3/3).
   * Without any it says nothing: infinite.
   */
  public double sigmaM() {
    if (from == null && to == null) {
      return Double.POSITIVE_INFINITY;
    }
    boolean between = from != null && to != null;
    double position = POSITION * POSITION * metres * (between ? 0.25 : 1);
    double heading = HEADING * HEADING * Math.pow(metres, 3) / (between ? 48 : 3);
    return Math.sqrt(position + heading + SIGHTING_M * SIGHTING_M * (between ? 0.5 : 1));
  }
}
