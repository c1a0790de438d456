package android.app;

import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.withSettings;

import android.content.ComponentName;
import android.content.Context;
import android.hardware.display.IDisplayManager;
import android.os.IBinder;
import android.os.IInterface;
import android.os.ServiceManager;
import android.view.IWindowManager;
import org.mockito.Mockito;
import org.mockito.stubbing.Answer;

/** Android's own services in other processes. They know what the newest {@link Phone} tells, as apps keep them for good. */
final class OtherProcesses {
  private static Phone phone;

  private OtherProcesses() {}

  /** From now on they answer for this phone. */
  static void serve(Phone newest) {
    phone = newest;
    if (ServiceManager.getService(Context.ACTIVITY_SERVICE) == null) {
      put(Context.ACTIVITY_SERVICE, remote(IActivityManager.class, call -> {
        if (call.getMethod().getName().equals("stopServiceToken")) {
          phone.stopService((ComponentName) call.getArgument(0));
        }
        return null;
      }));
      put(Context.ACTIVITY_TASK_SERVICE, remote(IActivityTaskManager.class,
          call -> call.getMethod().getName().equals("finishActivity") ? true : null));
      put(Context.NOTIFICATION_SERVICE, remote(INotificationManager.class));
      put(Context.WINDOW_SERVICE, remote(IWindowManager.class));
      put(Context.DISPLAY_SERVICE, remote(IDisplayManager.class,
          call -> call.getMethod().getName().equals("getDisplayInfo") ? phone.display : null));
    }
  }

  static IActivityManager activities() {
    return (IActivityManager) ServiceManager.getService(Context.ACTIVITY_SERVICE);
  }

  /** Another process: it knows nothing but this, and the phone remembers that it was asked. */
  static <T extends IInterface> T remote(Class<T> type, Answer<?> knows) {
    return mock(type, withSettings().extraInterfaces(IBinder.class).defaultAnswer(call -> {
      phone.calls.add(call.getMethod().getName());
      Object answer = call.getMethod().getName().equals("asBinder") ? call.getMock() : knows.answer(call);
      return answer == null ? Mockito.RETURNS_DEFAULTS.answer(call) : answer;
    }));
  }

  static <T extends IInterface> T remote(Class<T> type) {
    return remote(type, call -> null);
  }

  private static void put(String name, IInterface process) {
    ServiceManager.put(name, (IBinder) process);
  }
}
