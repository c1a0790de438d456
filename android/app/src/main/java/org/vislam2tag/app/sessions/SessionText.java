package org.vislam2tag.app.sessions;

import org.vislam2tag.app.R;
import org.vislam2tag.app.Words;
import org.vislam2tag.app.record.EndText;
import org.vislam2tag.core.handover.Outbox;
import org.vislam2tag.core.handover.UploadException;
import org.vislam2tag.core.session.StoredSession;

/** Sessions and their uploads in the collector's words. */
public final class SessionText {
  private final Words words;

  public SessionText(Words words) {
    this.words = words;
  }

  /** About a session: where and by what; how long, how large, how it ended; whether it was sent. */
  String of(StoredSession session, Outbox outbox) {
    String site = session.site.isEmpty() ? "" : session.site + ", ";
    String where = site + words.of(R.string.session_where, session.floor, session.device);
    String size = words.of(R.string.session_size, minutes(session.durationS), session.bytes / 1e6);
    String end = session.end.isEmpty() ? words.of(R.string.end_unknown) : words.of(EndText.sentence(session.end), session.endDetail);
    return where + "\n" + size + " " + end + sent(session.folder.getName(), outbox);
  }

  /** Why an upload ended without the session filed. */
  public String of(UploadException failure) {
    return words.of(sentence(failure.reason), failure.getMessage());
  }

  private String sent(String session, Outbox outbox) {
    if (outbox.waiting().contains(session)) {
      return "\n" + words.of(R.string.waits_to_be_sent);
    }
    if (outbox.filedAt(session) != null) {
      return "\n\u2713 " + words.of(R.string.sent_to, outbox.filedAt(session));
    }
    return outbox.refusal(session) == null ? "" : "\n" + words.of(R.string.was_refused, outbox.refusal(session));
  }

  private static double minutes(double seconds) {
    return Double.isNaN(seconds) ? 0 : seconds / 60;
  }

  private static int sentence(UploadException.Cause reason) {
    switch (reason) {
      case WRONG_TOKEN:
        return R.string.upload_wrong_token;
      case TOO_LARGE:
        return R.string.upload_too_large;
      case REFUSED:
        return R.string.upload_refused;
      case COMPUTER_FULL:
        return R.string.upload_computer_full;
      case NO_CONNECTION:
        return R.string.upload_no_connection;
      case CANCELLED:
        return R.string.upload_cancelled;
      default:
        return R.string.upload_not_understood;
    }
  }
}
