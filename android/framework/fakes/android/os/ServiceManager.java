package android.os;

import java.util.Map;
import java.util.concurrent.ConcurrentHashMap;

/** Android's services in other processes: those that a test puts here, in this one. */
public final class ServiceManager {
  private static final Map<String, IBinder> SERVICES = new ConcurrentHashMap<>();

  private ServiceManager() {}

  /** Puts what answers from now on. */
  public static void put(String name, IBinder service) {
    SERVICES.put(name, service);
  }

  public static IBinder getService(String name) {
    return SERVICES.get(name);
  }

  public static IBinder checkService(String name) {
    return SERVICES.get(name);
  }

  public static IBinder getServiceOrThrow(String name) throws ServiceNotFoundException {
    IBinder service = SERVICES.get(name);
    if (service == null) {
      throw new ServiceNotFoundException(name);
    }
    return service;
  }

  public static final class ServiceNotFoundException extends Exception {
    private static final long serialVersionUID = 1;

    public ServiceNotFoundException(String name) {
      super("No service published for: " + name);
    }
  }
}
