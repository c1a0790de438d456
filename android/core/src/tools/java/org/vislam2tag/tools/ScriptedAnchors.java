package org.vislam2tag.tools;

import java.util.HashMap;
import java.util.HashSet;
import java.util.Map;
import java.util.Set;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.tracking.AnchorHost;

/** The anchors of a scripted tracker: it answers what the script says of them at each frame. */
final class ScriptedAnchors implements AnchorHost {
  private final Set<Integer> set = new HashSet<>();
  private final Map<Integer, State> told = new HashMap<>();
  private ScriptLine frame;

  /** A frame begins. */
  void frame(ScriptLine line) {
    frame = line;
    told.clear();
  }

  /** In this frame the anchor is there. */
  void tell(int number, State state) {
    told.put(number, state);
  }

  /** The frame was recorded: did the script tell of an anchor that was never set? */
  void check() {
    for (int number : told.keySet()) {
      if (!set.contains(number)) {
        throw frame.wrong("anchor " + number + " was never set");
      }
    }
  }

  @Override public boolean set(int number, Pose pose) {
    set.add(number);
    return true;
  }

  @Override public State get(int number) {
    State state = told.get(number);
    if (state == null) {
      throw frame.wrong("anchor " + number + " is asked for, and the frame does not have it");
    }
    return state;
  }

  @Override public void detach(int number) {}
}
