package org.vislam2tag.core.landmarks;

import java.util.Locale;

/** An image that is not looked for, and why. */
public final class Refusal {
  /** Why an image is refused. */
  public enum Reason {
    /** The manifest's line cannot be used; the detail says what of it. */
    BAD_LINE,
    /** The manifest names a file that is not there. */
    NO_FILE,
    /** Another image has this id. */
    DUPLICATE_ID,
    /** The file is no image that can be read. */
    UNREADABLE,
    /** Fewer pixels than the tracker needs. */
    TOO_SMALL,
    /** Little contrast, or few corners in few places. */
    TOO_PLAIN,
    /** The tracker itself refuses it. */
    TRACKER,
    /** More images than the tracker takes. */
    TOO_MANY
  }

  /** The landmark's id, or the file's name where it has none. */
  public final String id;
  public final Reason reason;
  /** More about it; may be empty. */
  public final String detail;

  public Refusal(String id, Reason reason, String detail) {
    this.id = id;
    this.reason = reason;
    this.detail = detail;
  }

  /** The detail of the event {@code landmark_refused}. */
  public String words() {
    return id + " " + reason.name().toLowerCase(Locale.ROOT) + (detail.isEmpty() ? "" : ": " + detail);
  }
}
