package android.content;

/** Numbers of what Android logs; on a phone its build makes them. */
final class EventLogTags {
  static final int CONTENT_QUERY_SAMPLE = 52002;
  static final int CONTENT_UPDATE_SAMPLE = 52003;

  private EventLogTags() {}
}
