package org.vislam2tag.app.record;

import org.vislam2tag.app.R;
import org.vislam2tag.core.session.EndState;
import org.vislam2tag.core.session.SessionEnd;

/** How a session ended, in the collector's words. */
public final class EndText {
  private EndText() {}

  /** The sentence; {@code %s} in it is the detail. */
  static int sentence(SessionEnd end) {
    return sentence(end.state.word());
  }

  /** The sentence for a state as session.json has it. */
  public static int sentence(String state) {
    if (state.equals(EndState.STOPPED.word())) {
      return R.string.end_stopped;
    }
    if (state.equals(EndState.DISK_FULL.word())) {
      return R.string.end_disk_full;
    }
    if (state.equals(EndState.WRITE_FAILED.word())) {
      return R.string.end_write_failed;
    }
    return state.equals(EndState.KILLED.word()) ? R.string.end_killed : R.string.end_crashed;
  }
}
