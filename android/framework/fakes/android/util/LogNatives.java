package android.util;

/** Android's log, of which a test shows what is as bad as an error. */
final class LogNatives {
  private LogNatives() {}

  static boolean isLoggable(String tag, int level) {
    return level >= Log.WARN;
  }

  static int println_native(int buffer, int priority, String tag, String message) {
    if (priority >= Log.ERROR) {
      System.err.println(tag + ": " + message);
    }
    return 0;
  }

  static int logger_entry_max_payload_native() {
    return 4000;
  }
}
