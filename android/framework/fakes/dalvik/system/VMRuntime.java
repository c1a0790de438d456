package dalvik.system;

import java.lang.ref.WeakReference;
import java.lang.reflect.Array;
import java.util.HashMap;
import java.util.Map;

/** The JVM as Android's runtime. */
public final class VMRuntime {
  public static final int SDK_VERSION_CUR_DEVELOPMENT = 10_000;

  private static final Map<Long, WeakReference<int[]>> ARRAYS = new HashMap<>();
  private static final VMRuntime RUNTIME = new VMRuntime();

  public static VMRuntime getRuntime() {
    return RUNTIME;
  }

  public static boolean is64BitAbi(String abi) {
    return abi.contains("64");
  }

  public boolean is64Bit() {
    return true;
  }

  public Object newUnpaddedArray(Class<?> type, int length) {
    return Array.newInstance(type, length);
  }

  public Object newNonMovableArray(Class<?> type, int length) {
    return Array.newInstance(type, length);
  }

  /** Memory outside of the JVM's for an array of whole numbers, whose own the JVM may move. */
  public long addressOf(int[] array) {
    synchronized (ARRAYS) {
      long address = allocate(4L * array.length);
      ARRAYS.put(address, new WeakReference<>(array));
      return address;
    }
  }

  /** Copies what native code wrote into such memory into its arrays. */
  public static void fetch(long... addresses) {
    synchronized (ARRAYS) {
      for (long address : addresses) {
        copy(address, ARRAYS.get(address).get());
      }
    }
  }

  private static native long allocate(long bytes);

  private static native void copy(long address, int[] into);

  public void notifyStartupCompleted() {}

  public int getTargetSdkVersion() {
    return android.os.Build.VERSION.SDK_INT;
  }

  public void setTargetSdkVersion(int version) {}

  public void registerNativeAllocation(int bytes) {}

  public void registerNativeFree(int bytes) {}

  public void runFinalizationSync() {}
}
