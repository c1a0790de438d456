package android.graphics;

/** A tint. */
final class PorterDuffColorFilterNatives {
  private PorterDuffColorFilterNatives() {}

  static long native_CreateBlendModeFilter(int colour, int mode) {
    return Handles.of(new int[] {colour, mode});
  }
}
