package dalvik.system;

/** Lets every thread read and write. */
public final class BlockGuard {
  public interface Policy {
    void onWriteToDisk();

    void onReadFromDisk();

    void onNetwork();

    void onUnbufferedIO();

    void onExplicitGc();

    int getPolicyMask();
  }

  public interface VmPolicy {
    void onPathAccess(String path);
  }

  public static final Policy LAX_POLICY = new Policy() {
    @Override public void onWriteToDisk() {}

    @Override public void onReadFromDisk() {}

    @Override public void onNetwork() {}

    @Override public void onUnbufferedIO() {}

    @Override public void onExplicitGc() {}

    @Override public int getPolicyMask() {
      return 0;
    }
  };
  public static final VmPolicy LAX_VM_POLICY = path -> {};

  public static Policy getThreadPolicy() {
    return LAX_POLICY;
  }

  public static void setThreadPolicy(Policy policy) {}

  public static VmPolicy getVmPolicy() {
    return LAX_VM_POLICY;
  }

  public static void setVmPolicy(VmPolicy policy) {}
}
