package org.vislam2tag.core.session;

import java.util.Locale;

/** How a session ended. */
public enum EndState {
  STOPPED, CRASHED, DISK_FULL, WRITE_FAILED, KILLED;

  /** As in session.json and, but for killed, in Events.csv. */
  public String word() {
    return name().toLowerCase(Locale.ROOT);
  }
}
