package org.vislam2tag.app.recording;

import android.Manifest;
import android.app.Notification;
import android.app.Service;
import android.bluetooth.BluetoothManager;
import android.content.Context;
import android.content.Intent;
import android.content.pm.PackageManager;
import android.content.pm.ServiceInfo;
import android.hardware.SensorManager;
import android.location.LocationManager;
import android.media.AudioManager;
import android.media.ToneGenerator;
import android.net.wifi.WifiManager;
import android.os.Binder;
import android.os.Build;
import android.os.Handler;
import android.os.IBinder;
import android.os.Looper;
import android.os.PowerManager;
import android.os.VibrationEffect;
import android.os.Vibrator;
import java.io.File;
import java.io.IOException;
import java.util.Arrays;
import java.util.List;
import org.vislam2tag.app.sensing.BleLog;
import org.vislam2tag.app.sensing.Calls;
import org.vislam2tag.app.sensing.Feed;
import org.vislam2tag.app.sensing.RttLog;
import org.vislam2tag.app.sensing.SensorLog;
import org.vislam2tag.app.sensing.Surroundings;
import org.vislam2tag.app.sensing.WifiLog;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.session.Recorder;
import org.vislam2tag.core.session.RecorderListener;
import org.vislam2tag.core.session.RecorderSettings;
import org.vislam2tag.core.session.SessionDescription;
import org.vislam2tag.core.session.SessionEnd;
import org.vislam2tag.core.session.SessionStore;
import org.vislam2tag.core.session.StoredSession;
import org.vislam2tag.core.site.SiteStore;
import org.vislam2tag.core.table.FileSink;
import org.vislam2tag.core.walk.Warning;

/** Keeps a recording alive while the screen is off or another app is in front. */
public final class RecordingService extends Service implements RecorderListener {
  private static final String ARCORE = "com.google.ar.core";
  private static final long WARNING_MS = 300;
  private static final long CAUGHT_MS = 60;
  private static final int CAUGHT_LOUDNESS = 80;
  private static final long LONGEST_MS = 12L * 3600 * 1000;

  /** What the screen holds of the service. */
  public final class Link extends Binder {
    /** The recording that runs; null where none does. */
    public Recording recording() {
      return recording;
    }

    /**
     * Starts one; where one runs already, as after a second tap, that goes on.
     *
     * @throws IOException if the session's files cannot be made, or Android does not let the service run
     */
    public void start(Plan plan) throws IOException {
      RecordingService.this.start(plan);
    }

    /** What the collector chose for the recording that runs; null where none does. */
    public Plan plan() {
      return recording == null ? null : plan;
    }

    /** Stops it; {@link #recording} becomes null, and {@link #lastEnd} known, once all is on the disk. */
    public void stop() {
      RecordingService.this.stop();
    }

    /** How the latest session ended; null before the first. */
    public SessionEnd lastEnd() {
      return lastEnd;
    }
  }

  /** Held while a session begins or those killed are looked for, which are known by not having ended. */
  private static final Object STORE = new Object();
  private static File open;

  private final PhoneClocks clocks = new PhoneClocks();
  /** The one that runs. */
  volatile Recording recording;
  private volatile Plan plan;
  private volatile SessionEnd lastEnd;
  private PowerManager.WakeLock awake;
  private boolean stopping;

  /** Where the sessions are kept: the app's own folder on the phone, which a cable reaches too. */
  public static File sessions(Context context) {
    File external = context.getExternalFilesDir(null);
    File folder = new File(external == null ? context.getFilesDir() : external, "sessions");
    folder.mkdirs();
    return folder;
  }

  /** Where what developers asked for is kept: scripts, and what ARCore recorded. A cable reaches it. */
  private static File developer(Context context) {
    File folder = new File(sessions(context).getParentFile(), "developer");
    folder.mkdirs();
    return folder;
  }

  /** Where the building that was taken from a computer is kept. */
  public static SiteStore site(Context context) {
    return new SiteStore(new File(context.getFilesDir(), "site"));
  }

  /**
   * The sessions on the phone but for the one being recorded; those that were killed are finished first. Not for the main
   * thread.
   *
   * @throws IOException if one that was killed cannot be finished
   */
  public static List<StoredSession> endedSessions(Context context) throws IOException {
    SessionStore store = new SessionStore(sessions(context));
    synchronized (STORE) {
      store.recover(open);
      return store.list(open);
    }
  }

  @Override public IBinder onBind(Intent intent) {
    return new Link();
  }

  @Override public int onStartCommand(Intent intent, int flags, int startId) {
    return START_NOT_STICKY; // a killed recording is finished by the next start of the app, not gone on with
  }

  @Override public void onDestroy() {
    stop();
    super.onDestroy();
  }

  @Override public void warning(Warning warning) {
    buzz(WARNING_MS);
  }

  /** Who walks looks at the way, not at the screen. */
  @Override public void caught(String landmark) {
    buzz(CAUGHT_MS);
    try {
      ToneGenerator tone = new ToneGenerator(AudioManager.STREAM_NOTIFICATION, CAUGHT_LOUDNESS);
      tone.startTone(ToneGenerator.TONE_PROP_ACK, (int) CAUGHT_MS);
      new Handler(Looper.getMainLooper()).postDelayed(tone::release, 5 * CAUGHT_MS);
    } catch (RuntimeException e) {
      Recording running = recording;
      if (running != null) {
        running.recorder().event("no_sound", ""); // as while a call holds the phone's sound
      }
    }
  }

  /** The screen is off: only a notice with a sound is noticed. */
  @Override public void scansStopped(Radio radio) {
    new Notices(this).stopped(radio);
    buzz(WARNING_MS);
  }

  private void buzz(long ms) {
    Vibrator vibrator = (Vibrator) getSystemService(VIBRATOR_SERVICE);
    vibrator.vibrate(VibrationEffect.createOneShot(ms, VibrationEffect.DEFAULT_AMPLITUDE));
  }

  /** Also when a session ends by itself, as the disk is full: the service ends with it. */
  @Override public void ended(SessionEnd end) {
    lastEnd = end;
    new Handler(Looper.getMainLooper()).post(this::stop);
  }

  private void start(Plan chosen) throws IOException {
    if (recording != null) {
      return;
    }
    plan = chosen;
    SensorLog sensors = new SensorLog((SensorManager) getSystemService(SENSOR_SERVICE), plan.sensorRateHz);
    Recorder recorder = begin(description(plan, sensors));
    CrashGuard.guard(recorder);
    try {
      goForeground();
    } catch (RuntimeException e) { // Android does not let it: nothing must go on that cannot be stopped
      recorder.crashed(e);
      synchronized (STORE) {
        open = null;
      }
      stopped();
      throw new IOException(e.toString(), e);
    }
    for (String event : plan.eventsAtStart) {
      recorder.event(event, "");
    }
    recording = new Recording(recorder, plan.landmarks, feeds(sensors), plan.forDevelopers ? developer(this) : null);
  }

  private List<Feed> feeds(SensorLog sensors) {
    BluetoothManager bluetooth = (BluetoothManager) getSystemService(BLUETOOTH_SERVICE);
    Handler handler = new Handler(Looper.getMainLooper());
    BleLog ble = new BleLog(bluetooth == null ? null : bluetooth.getAdapter(), handler);
    WifiManager wifi = (WifiManager) getApplicationContext().getSystemService(WIFI_SERVICE);
    return Arrays.asList(sensors, new WifiLog(this, wifi, handler, clocks),
        RttLog.of(this, wifi, handler), ble,
        new Calls((AudioManager) getSystemService(AUDIO_SERVICE), handler),
        new Surroundings(this, ble, (LocationManager) getSystemService(LOCATION_SERVICE)));
  }

  private Recorder begin(SessionDescription description) throws IOException {
    synchronized (STORE) {
      Recorder.Setup setup = new Recorder.Setup(clocks, RecorderSettings.usual(), this, FileSink::new, null);
      Recorder recorder =
          Recorder.start(plan.forDevelopers ? setup.withScripts(developer(this)) : setup, description, sessions(this));
      open = recorder.folder();
      return recorder;
    }
  }

  private void stop() {
    Recording running = recording;
    if (running == null || stopping) {
      return;
    }
    stopping = true;
    running.stopFeeds();
    new Thread(() -> close(running), "stop").start(); // waits for the disk
  }

  private void close(Recording running) {
    lastEnd = running.stop();
    synchronized (STORE) {
      open = null;
    }
    new Handler(Looper.getMainLooper()).post(this::stopped);
  }

  private void stopped() {
    recording = null;
    stopping = false;
    CrashGuard.release();
    if (awake != null && awake.isHeld()) {
      awake.release();
    }
    stopForeground(true);
    stopSelf();
  }

  private SessionDescription description(Plan plan, SensorLog sensors) {
    SessionDescription.Builder description = new SessionDescription.Builder().place(plan.site, plan.floor).device(plan.device)
        .note(plan.note).app(version(getPackageName()))
        .phone(Build.MANUFACTURER, Build.MODEL, Build.VERSION.RELEASE, Build.VERSION.SDK_INT, version(ARCORE))
        .landmarks(plan.landmarks.count(), plan.landmarks.refusedIds());
    sensors.describe(description);
    return description.build();
  }

  private String version(String app) {
    try {
      return getPackageManager().getPackageInfo(app, 0).versionName;
    } catch (PackageManager.NameNotFoundException e) {
      return null;
    }
  }

  /** From Android 14 on a service that says location without the permission is ended at once. */
  static int foregroundType(boolean locationAllowed) {
    return ServiceInfo.FOREGROUND_SERVICE_TYPE_CONNECTED_DEVICE
        | (locationAllowed ? ServiceInfo.FOREGROUND_SERVICE_TYPE_LOCATION : 0);
  }

  private boolean locationAllowed() {
    return checkSelfPermission(Manifest.permission.ACCESS_FINE_LOCATION) == PackageManager.PERMISSION_GRANTED
        || checkSelfPermission(Manifest.permission.ACCESS_COARSE_LOCATION) == PackageManager.PERMISSION_GRANTED;
  }

  private void goForeground() {
    startForegroundService(new Intent(this, RecordingService.class));
    Notification notification = new Notices(this).recording();
    if (Build.VERSION.SDK_INT >= Build.VERSION_CODES.Q) {
      startForeground(Notices.RECORDING, notification, foregroundType(locationAllowed()));
    } else {
      startForeground(Notices.RECORDING, notification);
    }
    awake = ((PowerManager) getSystemService(POWER_SERVICE)).newWakeLock(PowerManager.PARTIAL_WAKE_LOCK, "vislam2tag:recording");
    awake.acquire(LONGEST_MS);
  }
}
