package org.vislam2tag.app.record;

import android.app.Activity;
import android.app.AlertDialog;
import android.content.ComponentName;
import android.content.Intent;
import android.content.ServiceConnection;
import android.content.pm.PackageManager;
import android.os.BatteryManager;
import android.os.Bundle;
import android.os.Handler;
import android.os.IBinder;
import android.os.Looper;
import android.view.HapticFeedbackConstants;
import android.view.MotionEvent;
import android.view.SoundEffectConstants;
import android.view.View;
import android.view.ViewGroup;
import android.view.WindowManager;
import android.widget.TextView;
import android.widget.Toast;
import com.google.ar.core.ArCoreApk;
import java.util.List;
import org.vislam2tag.app.R;
import org.vislam2tag.app.ar.CameraView;
import org.vislam2tag.app.recording.PhoneClocks;
import org.vislam2tag.app.recording.Recording;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.core.session.RecorderStatus;
import org.vislam2tag.core.session.SessionEnd;
import org.vislam2tag.core.site.Site;
import org.vislam2tag.core.site.SiteFloor;

/** The screen while a session is recorded. */
public final class RecordActivity extends Activity implements ServiceConnection {
  private static final long REFRESH_MS = 250;

  private final Handler handler = new Handler(Looper.getMainLooper());
  private final Runnable refresh = this::refresh;
  private final StatusText text = new StatusText(this::getString);
  private RecordingService.Link service;
  private CameraView camera;
  private PlanView plan;
  private FloorPlan floorPlan;

  @Override protected void onCreate(Bundle saved) {
    super.onCreate(saved);
    setContentView(R.layout.record);
    getWindow().addFlags(WindowManager.LayoutParams.FLAG_KEEP_SCREEN_ON);
    findViewById(R.id.control_point).setOnTouchListener(this::touched);
    findViewById(R.id.control_point).setOnClickListener(view -> press()); // screen readers click, and never touch
    findViewById(R.id.undo).setOnClickListener(view -> undo());
    findViewById(R.id.other_floor).setOnClickListener(view -> askForFloor());
    findViewById(R.id.stop).setOnClickListener(view -> askToStop());
    bindService(new Intent(this, RecordingService.class), this, BIND_AUTO_CREATE);
  }

  @Override protected void onResume() {
    super.onResume();
    if (camera != null) {
      camera.onResume();
    }
    handler.post(refresh);
  }

  @Override protected void onPause() {
    handler.removeCallbacks(refresh);
    if (camera != null) {
      camera.onPause();
    }
    super.onPause();
  }

  @Override protected void onDestroy() {
    unbindService(this);
    if (camera != null) {
      camera.release();
    }
    super.onDestroy();
  }

  /** The way back leads to the home screen, not out of the recording. */
  @Override public void onBackPressed() {
    moveTaskToBack(true);
  }

  @Override public void onServiceConnected(ComponentName name, IBinder link) {
    service = (RecordingService.Link) link;
    Recording recording = service.recording();
    if (recording == null || camera != null || plan != null) {
      return;
    }
    ViewGroup picture = findViewById(R.id.camera);
    if (service.plan().withCamera && canTrack()) {
      camera = new CameraView(this);
      camera.attach(recording, new PhoneClocks());
      picture.addView(camera);
      findViewById(R.id.other_floor).setVisibility(View.VISIBLE);
    } else {
      floorPlan = FloorPlan.of(this, service.plan().floor);
      plan = new PlanView(this, floorPlan.floor, floorPlan.picture, this::tapped); // tapped where the collector stands
      picture.addView(plan);
      findViewById(R.id.map).setVisibility(View.GONE); // without a tracker it stays empty, and the plan is tapped better when wide
    }
  }

  private void tapped(float xM, float yM, float sigmaM) {
    Recording recording = recording();
    if (recording != null) {
      recording.recorder().tap(xM, yM, sigmaM);
      plan.performHapticFeedback(HapticFeedbackConstants.VIRTUAL_KEY);
      plan.playSoundEffect(SoundEffectConstants.CLICK);
      plan.show(recording.recorder().taps());
    }
  }

  @Override public void onServiceDisconnected(ComponentName name) {
    service = null;
  }

  /** The press counts when the finger comes down: that is when the collector stands on the point. */
  private boolean touched(View button, MotionEvent event) {
    if (event.getActionMasked() == MotionEvent.ACTION_DOWN) {
      press();
      button.setPressed(true);
    } else if (event.getActionMasked() == MotionEvent.ACTION_UP || event.getActionMasked() == MotionEvent.ACTION_CANCEL) {
      button.setPressed(false);
    }
    return true;
  }

  private void press() {
    Recording recording = recording();
    if (recording != null) {
      recording.recorder().press();
      View button = findViewById(R.id.control_point);
      button.performHapticFeedback(HapticFeedbackConstants.VIRTUAL_KEY);
      button.playSoundEffect(SoundEffectConstants.CLICK);
    }
  }

  private void undo() {
    Recording recording = recording();
    if (recording == null) {
      return;
    }
    recording.recorder().undoPress();
    if (plan != null) {
      plan.show(recording.recorder().taps());
    }
  }

  /** Only with camera: taps on another floor's plan are a walk of their own, as nothing connects the two. */
  private void askForFloor() {
    Recording recording = recording();
    if (recording == null) {
      return;
    }
    List<SiteFloor> floors = Site.floorsBeside(RecordingService.site(this).site(), recording.recorder().status().floor);
    CharSequence[] names = floors.stream().map(SiteFloor::toString).toArray(CharSequence[]::new);
    new AlertDialog.Builder(this).setTitle(R.string.other_floor_question).setNegativeButton(android.R.string.cancel, null)
        .setItems(names, (dialog, which) -> recording.recorder().floor(floors.get(which).number)).show();
  }

  /** Stop stands beside Undo, under a thumb that walks. */
  private void askToStop() {
    Recording recording = recording();
    String sofar = recording == null ? "" : text.summary(recording.recorder().status()) + "\n\n";
    new AlertDialog.Builder(this).setMessage(sofar + getString(R.string.stop_question)).setNegativeButton(R.string.go_on, null)
        .setPositiveButton(R.string.stop, (dialog, which) -> stop()).show();
  }

  private void stop() {
    if (service != null) {
      service.stop();
    }
  }

  private void refresh() {
    Recording recording = recording();
    if (recording != null) {
      RecorderStatus status = recording.recorder().status();
      show(status);
      if (floorPlan == null || floorPlan.floor.number != status.floor) {
        floorPlan = FloorPlan.of(this, status.floor);
      }
      ((MapView) findViewById(R.id.map)).show(recording.recorder().map(), floorPlan);
    } else if (service != null) {
      over(service.lastEnd());
      return;
    }
    handler.postDelayed(refresh, REFRESH_MS);
  }

  private void show(RecorderStatus status) {
    set(R.id.walk, text.walk(status));
    set(R.id.tracking, tracking(status));
    set(R.id.landmarks, text.landmarks(status.walk));
    set(R.id.scans, text.scans(status));
    BatteryManager battery = (BatteryManager) getSystemService(BATTERY_SERVICE);
    set(R.id.supplies, text.supplies(RecordingService.sessions(this).getUsableSpace(),
        battery.getIntProperty(BatteryManager.BATTERY_PROPERTY_CAPACITY)));
    setIfAny(R.id.hints, text.hints(status));
    setIfAny(R.id.warnings, text.warnings(status.walk));
    set(R.id.control_point, getString(R.string.control_point, status.presses));
    set(R.id.other_floor, getString(R.string.other_floor, status.floor));
    findViewById(R.id.undo).setEnabled(status.presses > 0);
  }

  private String tracking(RecorderStatus status) {
    if (plan != null) {
      return getString(R.string.taps_help);
    }
    return camera != null && camera.isPreparing() ? getString(R.string.tracking_preparing) : text.tracking(status.walk);
  }

  private void over(SessionEnd end) {
    if (end != null) {
      Toast.makeText(this, getString(EndText.sentence(end), end.detail), Toast.LENGTH_LONG).show();
    }
    finish();
  }

  private boolean canTrack() {
    return checkSelfPermission(android.Manifest.permission.CAMERA) == PackageManager.PERMISSION_GRANTED
        && ArCoreApk.getInstance().checkAvailability(this) == ArCoreApk.Availability.SUPPORTED_INSTALLED;
  }

  private Recording recording() {
    return service == null ? null : service.recording();
  }

  private void setIfAny(int id, String words) {
    set(id, words);
    findViewById(id).setVisibility(words.isEmpty() ? View.GONE : View.VISIBLE);
  }

  private void set(int id, String words) {
    ((TextView) findViewById(id)).setText(words);
  }
}
