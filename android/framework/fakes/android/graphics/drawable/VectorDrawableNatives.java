package android.graphics.drawable;

/** Drawings of paths: their numbers are all zero, and they are not drawn. */
final class VectorDrawableNatives {
  private VectorDrawableNatives() {}

  static boolean nGetFullPathProperties(long path, byte[] properties, int length) {
    return true;
  }

  static boolean nGetGroupProperties(long group, float[] properties, int length) {
    return true;
  }
}
