package android.util;

/** Counts nothing. */
class StatsLogInternal {
  public static final int TOUCH_GESTURE_CLASSIFIED = 1;
  public static final int TOUCH_GESTURE_CLASSIFIED__CLASSIFICATION__UNKNOWN_CLASSIFICATION = 0;
  public static final int TOUCH_GESTURE_CLASSIFIED__CLASSIFICATION__SINGLE_TAP = 1;
  public static final int TOUCH_GESTURE_CLASSIFIED__CLASSIFICATION__LONG_PRESS = 3;
  public static final int TOUCH_GESTURE_CLASSIFIED__CLASSIFICATION__DEEP_PRESS = 4;

  public static int write(int code, Object... values) {
    return 0;
  }
}
