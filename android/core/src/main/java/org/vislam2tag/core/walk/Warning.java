package org.vislam2tag.core.walk;

/** What the screen warns of. */
public enum Warning {
  /** No landmark was in view for too long or too far. */
  NO_LANDMARK("no_landmark"),
  /** The tracker has lost the camera's pose. */
  TRACKING("tracking"),
  /** The phone moves or turns faster than the tracker likes. */
  TOO_FAST("too_fast");

  /** The detail of the event {@code warning}. */
  public final String word;

  Warning(String word) {
    this.word = word;
  }
}
