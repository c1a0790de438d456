package com.android.internal.logging;

import android.content.Context;

/** Counts nothing. */
public class MetricsLogger {
  public static void action(Context context, int category) {}

  public static void action(Context context, int category, int value) {}

  public static void action(Context context, int category, boolean value) {}

  public static void action(Context context, int category, String value) {}

  public static void visible(Context context, int category) {}

  public static void hidden(Context context, int category) {}
}
