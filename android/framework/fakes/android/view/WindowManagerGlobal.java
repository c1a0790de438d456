package android.view;

import android.content.Context;
import android.os.IBinder;
import android.os.ServiceManager;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;

/** The windows of one app, the topmost last; there is no screen that they are sent to. */
public final class WindowManagerGlobal {
  private static final WindowManagerGlobal GLOBAL = new WindowManagerGlobal();

  private final List<View> windows = new ArrayList<>();

  private WindowManagerGlobal() {}

  public static void initialize() {}

  public static WindowManagerGlobal getInstance() {
    return GLOBAL;
  }

  public static IWindowManager getWindowManagerService() {
    return IWindowManager.Stub.asInterface(ServiceManager.getService(Context.WINDOW_SERVICE));
  }

  /** None of them is seen by Android's inspector of layouts. */
  public ArrayList<ViewRootImpl> getRootViews(IBinder token) {
    return new ArrayList<>();
  }

  public static IWindowSession peekWindowSession() {
    return null;
  }

  /** What is shown. */
  public List<View> windows() {
    return Collections.unmodifiableList(windows);
  }

  public void addView(View view, ViewGroup.LayoutParams parameters, Display display, Window parent) {
    if (windows.contains(view)) {
      throw new IllegalStateException("View " + view + " has already been added to the window manager.");
    }
    view.setLayoutParams(parameters);
    windows.add(view);
  }

  public void updateViewLayout(View view, ViewGroup.LayoutParams parameters) {
    view.setLayoutParams(parameters);
  }

  public void removeView(View view, boolean immediate) {
    if (!windows.remove(view)) {
      throw new IllegalArgumentException("View=" + view + " not attached to window manager");
    }
  }

  /** Where an activity ends with a window of its own still shown, Android logs a leak. */
  public void closeAll(IBinder token, String who, String what) {
    windows.clear();
  }

  public void setStoppedState(IBinder token, boolean stopped) {}

  public void changeCanvasOpacity(IBinder token, boolean opaque) {}
}
