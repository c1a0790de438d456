package org.vislam2tag.core.walk;

import java.util.ArrayDeque;
import java.util.Deque;
import org.vislam2tag.core.record.Press;

/** Numbers the presses of the control-point button and takes them back, the latest first. */
public final class PressCount {
  private final Deque<Integer> counting = new ArrayDeque<>();
  private int next;

  /** A press at {@code timeNs} on the boot clock. */
  public Press press(long timeNs) {
    counting.addLast(next);
    return new Press(timeNs, next++, false);
  }

  /** Takes the latest press that still counts back; null where none does. */
  public Press undo(long timeNs) {
    return counting.isEmpty() ? null : new Press(timeNs, counting.removeLast(), true);
  }

  /** How many presses count. */
  public int counting() {
    return counting.size();
  }
}
