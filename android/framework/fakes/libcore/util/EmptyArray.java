package libcore.util;

/** Arrays of no length. */
public final class EmptyArray {
  public static final boolean[] BOOLEAN = {};
  public static final byte[] BYTE = {};
  public static final char[] CHAR = {};
  public static final double[] DOUBLE = {};
  public static final float[] FLOAT = {};
  public static final int[] INT = {};
  public static final long[] LONG = {};
  public static final Class<?>[] CLASS = {};
  public static final Object[] OBJECT = {};
  public static final String[] STRING = {};

  private EmptyArray() {}
}
