package android.app;

import android.content.AutofillOptions;
import android.content.BroadcastReceiver;
import android.content.ComponentName;
import android.content.ContentCaptureOptions;
import android.content.ContentResolver;
import android.content.Context;
import android.content.ContextWrapper;
import android.content.IContentProvider;
import android.content.Intent;
import android.content.IntentFilter;
import android.content.ServiceConnection;
import android.content.SharedPreferences;
import android.content.pm.ApplicationInfo;
import android.content.pm.PackageManager;
import android.content.res.AssetManager;
import android.content.res.Resources;
import android.hardware.display.DisplayManagerGlobal;
import android.os.Handler;
import android.os.Looper;
import android.view.Display;
import android.view.WindowManagerImpl;
import android.view.autofill.AutofillManager.AutofillClient;
import com.android.internal.policy.PhoneLayoutInflater;
import java.io.File;

/** What an activity or a service asks Android through: the {@link Phone}. All that is not here is not there. */
final class PhoneContext extends ContextWrapper {
  private final Phone phone;
  private final ContentResolver resolver;
  private Resources.Theme theme;

  PhoneContext(Phone phone) {
    super(null);
    this.phone = phone;
    resolver = new NoProviders(this, phone);
  }

  /** Every provider of another app is there and empty. */
  private static final class NoProviders extends ContentResolver {
    private final IContentProvider empty;

    NoProviders(Context context, Phone phone) {
      super(context);
      empty = OtherProcesses.remote(IContentProvider.class);
    }

    @Override protected IContentProvider acquireProvider(Context context, String name) {
      return empty;
    }

    @Override public boolean releaseProvider(IContentProvider provider) {
      return true;
    }

    @Override protected IContentProvider acquireUnstableProvider(Context context, String name) {
      return empty;
    }

    @Override public boolean releaseUnstableProvider(IContentProvider provider) {
      return true;
    }

    @Override public void unstableProviderDied(IContentProvider provider) {}
  }

  @Override public Object getSystemService(String name) {
    switch (name) {
      case LAYOUT_INFLATER_SERVICE:
        return new PhoneLayoutInflater(this);
      case WINDOW_SERVICE:
        return new WindowManagerImpl(this);
      default:
        return phone.services.get(name);
    }
  }

  @Override public String getSystemServiceName(Class<?> type) {
    return type.getName();
  }

  @Override public Resources getResources() {
    return phone.resources;
  }

  @Override public AssetManager getAssets() {
    return phone.resources.getAssets();
  }

  @Override public Resources.Theme getTheme() {
    if (theme == null) {
      theme = phone.resources.newTheme();
      theme.applyStyle(org.vislam2tag.app.R.style.App, true);
    }
    return theme;
  }

  @Override public void setTheme(int id) {}

  @Override public PackageManager getPackageManager() {
    return phone.packages;
  }

  @Override public String getPackageName() {
    return phone.app.packageName;
  }

  @Override public String getOpPackageName() {
    return phone.app.packageName;
  }

  @Override public String getBasePackageName() {
    return phone.app.packageName;
  }

  @Override public ApplicationInfo getApplicationInfo() {
    return phone.app;
  }

  @Override public Context getApplicationContext() {
    return phone.application;
  }

  @Override public ContentResolver getContentResolver() {
    return resolver;
  }

  @Override public ClassLoader getClassLoader() {
    return PhoneContext.class.getClassLoader();
  }

  @Override public Looper getMainLooper() {
    return Looper.getMainLooper();
  }

  @Override public File getFilesDir() {
    return phone.files;
  }

  @Override public File getCacheDir() {
    return phone.files;
  }

  @Override public File getExternalFilesDir(String type) {
    return phone.files;
  }

  @Override public SharedPreferences getSharedPreferences(String name, int mode) {
    return phone.preferences.computeIfAbsent(name, key -> new SharedPreferencesImpl(new File(phone.files, key + ".xml"), mode));
  }

  @Override public int checkSelfPermission(String permission) {
    return phone.granted.contains(permission) ? PackageManager.PERMISSION_GRANTED : PackageManager.PERMISSION_DENIED;
  }

  @Override public int checkCallingOrSelfPermission(String permission) {
    return checkSelfPermission(permission);
  }

  @Override public int checkPermission(String permission, int process, int user) {
    return checkSelfPermission(permission);
  }

  @Override public ComponentName startForegroundService(Intent intent) {
    return phone.start(intent);
  }

  @Override public boolean bindService(Intent intent, ServiceConnection connection, int flags) {
    return phone.bind(intent, connection);
  }

  @Override public void unbindService(ServiceConnection connection) {
    phone.unbind(connection);
  }

  @Override public Intent registerReceiver(BroadcastReceiver receiver, IntentFilter filter) {
    return registerReceiver(receiver, filter, null, null);
  }

  @Override public Intent registerReceiver(BroadcastReceiver receiver, IntentFilter filter, String permission, Handler handler) {
    phone.receivers.put(receiver, filter);
    return null;
  }

  @Override public void unregisterReceiver(BroadcastReceiver receiver) {
    if (phone.receivers.remove(receiver) == null) {
      throw new IllegalArgumentException("Receiver not registered: " + receiver);
    }
  }

  @Override public Context createDisplayContext(Display display) {
    return new PhoneContext(phone);
  }

  @Override public Display getDisplay() {
    return new Display(DisplayManagerGlobal.getInstance(), Display.DEFAULT_DISPLAY, phone.display, phone.resources);
  }

  @Override public int getDisplayId() {
    return Display.DEFAULT_DISPLAY;
  }

  @Override public int getUserId() {
    return 0;
  }

  @Override public boolean canLoadUnsafeResources() {
    return false;
  }

  @Override public boolean isRestricted() {
    return false;
  }

  @Override public AutofillClient getAutofillClient() {
    return null;
  }

  @Override public void setAutofillClient(AutofillClient client) {}

  @Override public AutofillOptions getAutofillOptions() {
    return null;
  }

  @Override public void setAutofillOptions(AutofillOptions options) {}

  @Override public ContentCaptureOptions getContentCaptureOptions() {
    return null;
  }

  @Override public void setContentCaptureOptions(ContentCaptureOptions options) {}
}
