package org.vislam2tag.core.session;

/** How a session ended, and why. */
public final class SessionEnd {
  public final EndState state;
  /** May be empty. */
  public final String detail;

  public SessionEnd(EndState state, String detail) {
    this.state = state;
    this.detail = detail;
  }
}
