package android.graphics;

/** A tint. */
final class BlendModeColorFilterNatives {
  private BlendModeColorFilterNatives() {}

  static long native_CreateBlendModeFilter(int colour, int mode) {
    return Handles.of(new int[] {colour, mode});
  }
}
