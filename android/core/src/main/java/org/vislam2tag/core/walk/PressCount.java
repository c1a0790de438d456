package org.vislam2tag.core.walk;

import java.util.ArrayDeque;
import java.util.Deque;
import java.util.List;
import java.util.stream.Collectors;
import org.vislam2tag.core.record.Press;

/** Numbers the presses of the control-point button and the taps on the plan, and takes them back, the latest first. */
public final class PressCount {
  private final Deque<Press> counting = new ArrayDeque<>();
  private int next;

  /** A press at {@code timeNs} on the boot clock. */
  public Press press(long timeNs) {
    counting.addLast(Press.button(timeNs, next++));
    return counting.getLast();
  }

  /** A tap on the plan: the walker is there. */
  public Press tap(long timeNs, float xM, float yM, float sigmaM) {
    counting.addLast(Press.tap(timeNs, next++, xM, yM, sigmaM));
    return counting.getLast();
  }

  /** The latest that still counts; null where none does. */
  public Press latest() {
    return counting.peekLast();
  }

  /** Takes the latest that still counts back; null where none does. */
  public Press undo(long timeNs) {
    return counting.isEmpty() ? null : counting.removeLast().undone(timeNs);
  }

  /** How many presses and taps count. */
  public int counting() {
    return counting.size();
  }

  /** The taps that count, in their order. */
  public List<Press> taps() {
    return counting.stream().filter(Press::isTap).collect(Collectors.toList());
  }
}
