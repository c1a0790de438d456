package android.app;

import static org.mockito.ArgumentMatchers.anyInt;
import static org.mockito.ArgumentMatchers.anyString;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.when;

import android.Manifest;
import android.content.BroadcastReceiver;
import android.content.ComponentName;
import android.content.ContentProvider;
import android.content.Context;
import android.content.Intent;
import android.content.IntentFilter;
import android.content.ServiceConnection;
import android.content.SharedPreferences;
import android.content.pm.ApplicationInfo;
import android.content.pm.PackageInfo;
import android.content.pm.PackageManager;
import android.content.pm.ProviderInfo;
import android.content.res.ApkAssets;
import android.content.res.AssetManager;
import android.content.res.Configuration;
import android.content.res.Resources;
import android.hardware.SensorManager;
import android.location.LocationManager;
import android.media.AudioManager;
import android.net.ConnectivityManager;
import android.net.Network;
import android.net.wifi.WifiManager;
import android.os.BatteryManager;
import android.os.Binder;
import android.os.Bundle;
import android.os.Handler;
import android.os.IBinder;
import android.os.Looper;
import android.os.MessageQueue;
import android.os.PowerManager;
import android.os.SystemClockNatives;
import android.os.Vibrator;
import android.util.DisplayMetrics;
import android.view.Display;
import android.view.DisplayInfo;
import android.view.View;
import android.view.WindowManagerGlobal;
import android.widget.TextView;
import android.widget.Toast;
import com.google.ar.core.ArCoreApk;
import java.io.File;
import java.lang.reflect.Field;
import java.lang.reflect.Method;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.HashMap;
import java.util.HashSet;
import java.util.List;
import java.util.Locale;
import java.util.Map;
import java.util.Set;
import java.util.concurrent.ConcurrentHashMap;
import java.util.function.BooleanSupplier;

/**
 * A phone with one app on it, on the thread of the test: Android's own activities, services, windows' contents, resources
 * and main loop, and fakes of what answers them from other processes and of the hardware.
 */
public final class Phone {
  private static final int LONGEST_WAIT_MS = 20_000;

  static {
    System.load(System.getProperty("framework.resources"));
    if (Looper.getMainLooper() == null) {
      Looper.prepareMainLooper();
    }
  }

  /** The app's own folder. */
  public final File files;
  /** What other apps and Android's own pages were asked to show, and services were asked to run. */
  public final List<Intent> started = new ArrayList<>();
  /** Calls of Android's services, by name. */
  public final List<String> calls = new ArrayList<>();
  /** Permissions that are given. */
  public final Set<String> granted = new HashSet<>();
  public final PackageManager packages = mock(PackageManager.class);
  final Map<String, Object> services = new HashMap<>();
  final Map<String, SharedPreferences> preferences = new HashMap<>();
  final Map<BroadcastReceiver, IntentFilter> receivers = new ConcurrentHashMap<>();
  final ActivityThread thread = new ActivityThread();
  final Resources resources;
  final DisplayInfo display = new DisplayInfo();
  final ApplicationInfo app = new ApplicationInfo();
  final Application application;
  private final Map<Class<? extends Service>, Running> running = new HashMap<>();
  private final Handler main = new Handler(Looper.getMainLooper());

  private static final class Running {
    Service service;
    IBinder link;
    final List<ServiceConnection> bound = new ArrayList<>();
    boolean started;
  }

  private static final class PhoneApplication extends Application {
    PhoneApplication(Context context) {
      attachBaseContext(context);
    }
  }

  private static final class Idle extends RuntimeException {
    private static final long serialVersionUID = 1;
  }

  /** A phone whose screen has this width and height in dp, a font scale, and a language. */
  public Phone(File files, int widthDp, int heightDp, float fontScale, Locale language) throws Exception {
    this.files = files;
    DisplayMetrics metrics = new DisplayMetrics();
    metrics.setToDefaults();
    metrics.density = 2;
    metrics.densityDpi = 320;
    metrics.scaledDensity = 2 * fontScale;
    metrics.widthPixels = 2 * widthDp;
    metrics.heightPixels = 2 * heightDp;
    Configuration configuration = new Configuration();
    configuration.setToDefaults();
    configuration.setLocale(language);
    configuration.fontScale = fontScale;
    configuration.densityDpi = 320;
    configuration.screenWidthDp = widthDp;
    configuration.screenHeightDp = heightDp;
    configuration.smallestScreenWidthDp = widthDp;
    configuration.orientation = Configuration.ORIENTATION_PORTRAIT;
    configuration.screenLayout = Configuration.SCREENLAYOUT_SIZE_NORMAL | Configuration.SCREENLAYOUT_LONG_YES;
    AssetManager assets = new AssetManager.Builder().addApkAssets(ApkAssets.loadFromPath(System.getProperty("framework.apk"))).build();
    resources = new Resources(assets, metrics, configuration);
    app.packageName = "org.vislam2tag.app";
    app.targetSdkVersion = 29;
    app.processName = app.packageName;
    display.logicalWidth = metrics.widthPixels;
    display.logicalHeight = metrics.heightPixels;
    display.appWidth = metrics.widthPixels;
    display.appHeight = metrics.heightPixels;
    display.supportedModes = new Display.Mode[] {new Display.Mode(0, metrics.widthPixels, metrics.heightPixels, 60)};
    display.logicalDensityDpi = metrics.densityDpi;
    thread.mInstrumentation = new Started();
    application = new PhoneApplication(new PhoneContext(this));
    forgetWaiting();
    OtherProcesses.serve(this);
    thread.mInitialApplication = application;
    Field current = ActivityThread.class.getDeclaredField("sCurrentActivityThread");
    current.setAccessible(true);
    current.set(null, thread);
    when(packages.getPackageInfo(anyString(), anyInt())).thenAnswer(call -> {
      PackageInfo info = new PackageInfo();
      info.versionName = "1.43";
      return info;
    });
    WindowManagerGlobal.getInstance().closeAll(null, "", "");
    Toast.SHOWN.clear();
  }

  /** A usual phone: all permissions are given, ARCore is installed, nothing is heard and no sensor tells anything. */
  public static Phone usual(File files) throws Exception {
    return usual(files, 360, 640, 1, Locale.ENGLISH);
  }

  /** A usual phone with another screen, font scale or language. */
  public static Phone usual(File files, int widthDp, int heightDp, float fontScale, Locale language) throws Exception {
    Phone phone = new Phone(files, widthDp, heightDp, fontScale, language);
    phone.granted.addAll(Arrays.asList(Manifest.permission.CAMERA, Manifest.permission.ACCESS_FINE_LOCATION,
        Manifest.permission.ACCESS_COARSE_LOCATION));
    phone.service(Context.SENSOR_SERVICE, mock(SensorManager.class));
    phone.service(Context.WIFI_SERVICE, mock(WifiManager.class));
    phone.service(Context.LOCATION_SERVICE, mock(LocationManager.class));
    phone.service(Context.AUDIO_SERVICE, mock(AudioManager.class));
    phone.service(Context.VIBRATOR_SERVICE, mock(Vibrator.class));
    phone.service(Context.BATTERY_SERVICE, mock(BatteryManager.class));
    phone.service(Context.NOTIFICATION_SERVICE, new NotificationManager(phone.application, phone.main));
    ConnectivityManager networks = phone.service(Context.CONNECTIVITY_SERVICE, mock(ConnectivityManager.class));
    when(networks.getAllNetworks()).thenReturn(new Network[0]);
    PowerManager.WakeLock lock = mock(PowerManager.WakeLock.class);
    when(phone.service(Context.POWER_SERVICE, mock(PowerManager.class)).newWakeLock(anyInt(), anyString())).thenReturn(lock);
    ArCoreApk.instance = new ArCoreApk();
    return phone;
  }

  /** Its screen's size in dp, its language and its font scale. */
  public String name() {
    Configuration configuration = resources.getConfiguration();
    return configuration.screenWidthDp + "x" + configuration.screenHeightDp + "_" + configuration.getLocales().get(0) + "_" + fontScale();
  }

  public float fontScale() {
    return resources.getConfiguration().fontScale;
  }

  /** Sentences that were shown for a moment. */
  public List<String> toasts() {
    return Toast.SHOWN;
  }

  /** The app's own context. */
  public Context context() {
    return application;
  }

  /** Puts what {@code getSystemService} answers. */
  public <T> T service(String name, T service) {
    services.put(name, service);
    return service;
  }

  private final class Started extends Instrumentation {
    @Override public ActivityResult execStartActivity(Context who, IBinder in, IBinder token, Activity target, Intent intent,
        int request, Bundle options) {
      started.add(intent);
      return null;
    }

    @Override public ActivityResult execStartActivity(Context who, IBinder in, IBinder token, String target, Intent intent,
        int request, Bundle options) {
      started.add(intent);
      return null;
    }
  }

  /** Runs what waits on the main thread until nothing is due. */
  public void idle() {
    Idle nothingDue = new Idle();
    MessageQueue.IdleHandler whenIdle = () -> {
      main.post(() -> {
        throw nothingDue;
      });
      return false;
    };
    Looper.myQueue().addIdleHandler(whenIdle);
    try {
      Looper.loop();
    } catch (Idle e) {
      return;
    } finally {
      Looper.myQueue().removeIdleHandler(whenIdle);
    }
  }

  /** What an earlier test left waiting does not happen any more. */
  private static void forgetWaiting() throws ReflectiveOperationException {
    MessageQueue queue = Looper.myQueue();
    Method forget = MessageQueue.class.getDeclaredMethod("removeAllMessagesLocked");
    forget.setAccessible(true);
    synchronized (queue) {
      forget.invoke(queue);
    }
  }

  /** Lets time pass at once, and what is due by then happen. */
  public void pass(long ms) {
    SystemClockNatives.pass(ms);
    idle();
  }

  /** Runs the main thread until something that other threads bring about is so. */
  public void until(String what, BooleanSupplier isSo) throws InterruptedException {
    long end = System.nanoTime() + LONGEST_WAIT_MS * 1_000_000L;
    idle();
    while (!isSo.getAsBoolean()) {
      if (System.nanoTime() > end) {
        throw new AssertionError("never came: " + what);
      }
      Thread.sleep(1);
      idle();
    }
  }

  /** A broadcast: all who listen for its action hear it. */
  public void broadcast(Intent intent) {
    receivers.forEach((receiver, filter) -> {
      if (filter.hasAction(intent.getAction())) {
        receiver.onReceive(application, intent);
      }
    });
  }

  /** The newest of what was asked to be shown. */
  public Intent lastStarted() {
    return started.get(started.size() - 1);
  }

  /** Dialogs that are shown, the topmost last. */
  public List<View> dialogs() {
    return WindowManagerGlobal.getInstance().windows();
  }

  /** The sentences of the topmost dialog. */
  public String question() {
    View top = dialogs().get(dialogs().size() - 1);
    return ((TextView) top.findViewById(android.R.id.message)).getText().toString();
  }

  /** Presses a button of the topmost dialog: {@code android.R.id.button1} agrees. */
  public void answer(int button) {
    dialogs().get(dialogs().size() - 1).findViewById(button).performClick();
    idle();
  }

  /** An activity as it is once Android has attached it, and before its {@code onCreate}. */
  public <T extends Activity> Screen<T> open(Class<T> type, Intent intent) throws Exception {
    return new Screen<>(this, type, intent);
  }

  /** A provider of the app, as Android has it ready for other apps. */
  public <T extends ContentProvider> T provider(T provider, String authority) {
    ProviderInfo info = new ProviderInfo();
    info.authority = authority;
    info.applicationInfo = app;
    info.grantUriPermissions = true;
    provider.attachInfo(application, info);
    return provider;
  }

  /** The service of a class; null where it does not run. */
  public <T extends Service> T running(Class<T> type) {
    Running found = running.get(type);
    return found == null ? null : type.cast(found.service);
  }

  @SuppressWarnings("unchecked")
  private static Class<? extends Service> named(Intent intent) throws ClassNotFoundException {
    return (Class<? extends Service>) Class.forName(intent.getComponent().getClassName());
  }

  private Running service(Intent intent) {
    try {
      Class<? extends Service> type = named(intent);
      Running found = running.get(type);
      if (found == null) {
        found = new Running();
        running.put(type, found);
        found.service = type.getConstructor().newInstance();
        found.service.attach(new PhoneContext(this), thread, type.getName(), new Binder(), application, OtherProcesses.activities());
        found.service.onCreate();
      }
      return found;
    } catch (ReflectiveOperationException e) {
      throw new AssertionError(e);
    }
  }

  /** A service said that it has done. */
  void stopService(ComponentName name) {
    for (Map.Entry<Class<? extends Service>, Running> entry : running.entrySet()) {
      if (entry.getKey().getName().equals(name.getClassName())) {
        entry.getValue().started = false;
        main.post(() -> endUnused(entry.getKey()));
      }
    }
  }

  boolean bind(Intent intent, ServiceConnection connection) {
    main.post(() -> {
      Running found = service(intent);
      if (found.link == null) {
        found.link = found.service.onBind(intent);
      }
      found.bound.add(connection);
      connection.onServiceConnected(intent.getComponent(), found.link);
    });
    return true;
  }

  void unbind(ServiceConnection connection) {
    for (Class<? extends Service> type : new ArrayList<>(running.keySet())) {
      running.get(type).bound.remove(connection);
      main.post(() -> endUnused(type));
    }
  }

  ComponentName start(Intent intent) {
    started.add(intent);
    main.post(() -> {
      Running found = service(intent);
      found.started = true;
      found.service.onStartCommand(intent, 0, 1);
    });
    return intent.getComponent();
  }

  private void endUnused(Class<? extends Service> type) {
    Running found = running.get(type);
    if (found != null && !found.started && found.bound.isEmpty()) {
      running.remove(type);
      found.service.onDestroy();
    }
  }
}
