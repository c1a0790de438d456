package libcore.util;

/** There is no native memory to free. */
public final class NativeAllocationRegistry {
  public NativeAllocationRegistry(ClassLoader loader, long freeFunction, long size) {}

  public static NativeAllocationRegistry createMalloced(ClassLoader loader, long freeFunction) {
    return new NativeAllocationRegistry(loader, freeFunction, 0);
  }

  public static NativeAllocationRegistry createMalloced(ClassLoader loader, long freeFunction, long size) {
    return new NativeAllocationRegistry(loader, freeFunction, size);
  }

  public static NativeAllocationRegistry createNonmalloced(ClassLoader loader, long freeFunction, long size) {
    return new NativeAllocationRegistry(loader, freeFunction, size);
  }

  public Runnable registerNativeAllocation(Object owner, long native_) {
    return () -> {};
  }
}
