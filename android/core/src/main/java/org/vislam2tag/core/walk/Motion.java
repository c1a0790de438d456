package org.vislam2tag.core.walk;

import java.util.ArrayDeque;
import java.util.Deque;
import org.vislam2tag.core.record.Pose;

/** Metres walked, and speed and turning over the last second, from the camera's poses. */
public final class Motion {
  /** A step faster than this is the tracker's, not the collector's, m/s. */
  static final double JUMP_MPS = 6;
  /** Frames farther apart than this are no step, ns. */
  static final long GAP_NS = 500_000_000L;
  /** Speeds are means over this time, ns. */
  static final long MEAN_NS = 1_000_000_000L;

  private static final class Step {
    final long timeNs;
    final long tookNs;
    final double metres;
    final double radians;

    Step(long timeNs, long tookNs, double metres, double radians) {
      this.timeNs = timeNs;
      this.tookNs = tookNs;
      this.metres = metres;
      this.radians = radians;
    }
  }

  private final Deque<Step> steps = new ArrayDeque<>();
  private Pose last;
  private long lastNs;
  private double metres;

  /** The camera was here, tracked, at {@code timeNs} on the boot clock. */
  public void at(long timeNs, Pose pose) {
    if (last != null && timeNs > lastNs && timeNs - lastNs <= GAP_NS) {
      step(timeNs, timeNs - lastNs, last.distanceM(pose), last.angleRad(pose));
    }
    last = pose;
    lastNs = timeNs;
    forget(timeNs);
  }

  /** The camera has no pose now, or one in another frame: the next pose begins anew. */
  public void broke() {
    last = null;
    steps.clear();
  }

  /** Walked so far, m. */
  public double metres() {
    return metres;
  }

  /** Mean speed over the last second, m/s; 0 where there was less than half of one. */
  public double speedMps() {
    return mean(true);
  }

  /** Mean turning over the last second, rad/s; 0 where there was less than half of one. */
  public double turningRadps() {
    return mean(false);
  }

  private void step(long timeNs, long tookNs, double stepM, double stepRad) {
    if (stepM / (tookNs / 1e9) > JUMP_MPS) {
      return;
    }
    metres += stepM;
    steps.addLast(new Step(timeNs, tookNs, stepM, stepRad));
  }

  private void forget(long nowNs) {
    while (!steps.isEmpty() && nowNs - steps.peekFirst().timeNs >= MEAN_NS) {
      steps.removeFirst();
    }
  }

  private double mean(boolean way) {
    long tookNs = 0;
    double sum = 0;
    for (Step step : steps) {
      tookNs += step.tookNs;
      sum += way ? step.metres : step.radians;
    }
    return tookNs < MEAN_NS / 2 ? 0 : sum / (tookNs / 1e9);
  }
}
