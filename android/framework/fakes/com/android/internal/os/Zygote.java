package com.android.internal.os;

/** No process is forked here. */
public final class Zygote {
  public static final int DEBUG_JAVA_DEBUGGABLE = 1 << 8;

  private Zygote() {}
}
