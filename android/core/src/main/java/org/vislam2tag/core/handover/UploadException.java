package org.vislam2tag.core.handover;

/** The computer refuses the session, or the collector stopped; trying again at once does not help. */
public final class UploadException extends Exception {
  private static final long serialVersionUID = 1;

  /** What the screen says about it. */
  public enum Cause {
    /** The computer's token is another one: scan again. */
    WRONG_TOKEN,
    /** The session is larger than the computer takes. */
    TOO_LARGE,
    /** The zip arrived whole and is refused; resuming does not help. */
    REFUSED,
    /** The computer's disk is full; later it resumes. */
    COMPUTER_FULL,
    /** No connection for too long; later it resumes. */
    NO_CONNECTION,
    /** The collector stopped; later it resumes. */
    CANCELLED,
    /** An answer that this version does not understand. */
    NOT_UNDERSTOOD
  }

  public final Cause reason;

  UploadException(Cause reason, String message) {
    super(message);
    this.reason = reason;
  }
}
