package org.vislam2tag.app.setup;

import android.app.Activity;
import android.app.AlertDialog;
import android.content.ComponentName;
import android.content.Intent;
import android.content.ServiceConnection;
import android.net.Uri;
import android.os.Build;
import android.os.Bundle;
import android.os.Handler;
import android.os.IBinder;
import android.os.Looper;
import android.view.View;
import android.widget.ArrayAdapter;
import android.widget.Button;
import android.widget.CheckBox;
import android.widget.EditText;
import android.widget.LinearLayout;
import android.widget.Spinner;
import android.widget.TextView;
import android.widget.Toast;
import com.google.ar.core.ArCoreApk;
import java.io.File;
import java.io.IOException;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;
import org.vislam2tag.app.R;
import org.vislam2tag.app.about.AboutActivity;
import org.vislam2tag.app.ar.LandmarkImages;
import org.vislam2tag.app.record.RecordActivity;
import org.vislam2tag.app.recording.Plan;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.app.scan.ScanActivity;
import org.vislam2tag.app.sessions.SessionsActivity;
import org.vislam2tag.core.session.DeviceName;

/** First screen: where, with which landmarks; what stands in the way; start. */
public final class SetupActivity extends Activity implements ServiceConnection {
  private static final int PICK = 1;
  private static final int ASK = 2;
  private static final int SCAN = 3;
  private static final long LOOK_MS = 300;

  private final ExecutorService work = Executors.newSingleThreadExecutor();
  private Choices choices;
  private PlaceChoice place;
  private final Handler handler = new Handler(Looper.getMainLooper());
  private LandmarkImages landmarks = LandmarkImages.none();
  private String trouble = "";
  private boolean loading;
  private float loadedWidthM;
  private RecordingService.Link service;
  private ArCoreInstall install;

  @Override protected void onCreate(Bundle saved) {
    super.onCreate(saved);
    setContentView(R.layout.setup);
    choices = new Choices(this);
    install = new ArCoreInstall(ArCoreApk.getInstance());
    text(R.id.site).setText(choices.site());
    text(R.id.floor).setText(choices.floor());
    place = new PlaceChoice(this, work, this::say);
    place.show(choices.floor());
    ((CheckBox) findViewById(R.id.without_camera)).setChecked(choices.withoutCamera());
    text(R.id.device).setText(choices.device());
    text(R.id.width_cm).setText(Numbers.centimetres(choices.widthM()));
    Spinner rate = findViewById(R.id.rate);
    rate.setAdapter(new ArrayAdapter<>(this, android.R.layout.simple_spinner_dropdown_item,
        getResources().getStringArray(R.array.rates)));
    rate.setSelection(choices.rate());
    onClick(R.id.start, this::start);
    onClick(R.id.pick, this::pick);
    onClick(R.id.scan_site, () -> startActivityForResult(new Intent(this, ScanActivity.class), SCAN));
    onClick(R.id.sessions, () -> startActivity(new Intent(this, SessionsActivity.class)));
    onClick(R.id.unlock, () -> startActivity(new Intent(this, UnlockActivity.class)));
    onClick(R.id.about, () -> startActivity(new Intent(this, AboutActivity.class)));
    bindService(new Intent(this, RecordingService.class), this, BIND_AUTO_CREATE);
    loadLandmarks();
  }

  @Override protected void onResume() {
    super.onResume();
    tell(install.returned(this));
    show();
  }

  @Override protected void onPause() {
    handler.removeCallbacksAndMessages(null);
    choices.keep(place.site(), place.floor(), words(R.id.device), rate(), widthM());
    choices.keepWithoutCamera(withoutCamera());
    super.onPause();
  }

  @Override protected void onDestroy() {
    unbindService(this);
    work.shutdown();
    super.onDestroy();
  }

  @Override public void onServiceConnected(ComponentName name, IBinder link) {
    service = (RecordingService.Link) link;
    if (service.recording() != null) {
      startActivity(new Intent(this, RecordActivity.class));
      return;
    }
    work.execute(this::recover);
  }

  @Override public void onServiceDisconnected(ComponentName name) {
    service = null;
  }

  @Override protected void onActivityResult(int request, int result, Intent answer) {
    if (request == PICK && result == RESULT_OK && answer != null && answer.getData() != null) {
      Uri folder = answer.getData();
      getContentResolver().takePersistableUriPermission(folder, Intent.FLAG_GRANT_READ_URI_PERMISSION);
      choices.keepLandmarks(folder.toString());
      loadLandmarks();
    } else if (request == SCAN && result == RESULT_OK && answer != null) {
      place.take(answer.getStringExtra(ScanActivity.TEXT));
    }
  }

  /** What was refused for good Android asks no more: only the app's own page of its settings gives it then. */
  @Override public void onRequestPermissionsResult(int request, String[] permissions, int[] given) {
    show();
    for (int i = 0; i < given.length; i++) {
      if (Permissions.isAskedNoMore(permissions[i], given[i], shouldShowRequestPermissionRationale(permissions[i]))) {
        startActivity(Problem.Fix.APP_SETTINGS.settings(getPackageName()));
        return;
      }
    }
  }

  private void recover() {
    try {
      RecordingService.endedSessions(this);
    } catch (IOException e) {
      say(e.getMessage());
    }
  }

  private void pick() {
    startActivityForResult(new Intent(Intent.ACTION_OPEN_DOCUMENT_TREE), PICK);
  }

  private void loadLandmarks() {
    String folder = choices.landmarks();
    if (folder == null) {
      return;
    }
    float widthM = widthM();
    loadedWidthM = widthM;
    loading = true;
    show();
    work.execute(() -> {
      LandmarkImages loaded = LandmarkImages.none();
      String problem = "";
      try {
        PickedFolder picked = new PickedFolder(getContentResolver(), Uri.parse(folder), getString(R.string.folder_gone));
        loaded = LandmarkImages.load(picked, widthM, new File(getCacheDir(), "landmarks"));
      } catch (IOException e) {
        problem = e.getMessage();
      }
      LandmarkImages done = loaded;
      String words = problem;
      runOnUiThread(() -> {
        landmarks = done;
        trouble = words;
        loading = false;
        show();
      });
    });
  }

  private void show() {
    PhoneFacts facts = new PhoneLook(this).facts(landmarks);
    int count = landmarks.count();
    String counted = trouble.isEmpty() ? getResources().getQuantityString(R.plurals.landmarks, count, count) : trouble;
    text(R.id.landmarks).setText(loading ? getString(R.string.landmarks_loading) : counted);
    LinearLayout list = findViewById(R.id.problems);
    list.removeAllViews();
    for (Problem problem : facts.problems()) {
      if (problem != Problem.NO_LANDMARKS || !loading) {
        list.addView(row(list, problem, facts));
      }
    }
    if (facts.arCore == PhoneFacts.ArCore.BEING_LOOKED_UP) {
      handler.removeCallbacksAndMessages(null);
      handler.postDelayed(this::show, LOOK_MS);
    }
  }

  private View row(LinearLayout list, Problem problem, PhoneFacts facts) {
    View row = getLayoutInflater().inflate(R.layout.problem, list, false);
    ((TextView) row.findViewById(R.id.sentence)).setText(getString(problem.sentence, facts.names(problem)));
    Button fix = row.findViewById(R.id.fix);
    fix.setVisibility(problem.fix == Problem.Fix.NONE ? View.GONE : View.VISIBLE);
    fix.setOnClickListener(view -> fix(problem.fix));
    return row;
  }

  private void fix(Problem.Fix fix) {
    switch (fix) {
      case ASK_PERMISSIONS:
        requestPermissions(Permissions.needed(Build.VERSION.SDK_INT).toArray(new String[0]), ASK);
        break;
      case INSTALL_ARCORE:
        tell(install.ask(this));
        break;
      case PICK_LANDMARKS:
        pick();
        break;
      default:
        startActivity(fix.settings(getPackageName()));
        break;
    }
  }

  private void tell(int sentence) {
    if (sentence != ArCoreInstall.NOTHING) {
      say(getString(sentence));
    }
  }

  private void start() {
    int floor;
    try {
      floor = Integer.parseInt(place.floor());
    } catch (NumberFormatException e) {
      say(getString(R.string.floor_wrong));
      return;
    }
    if (!DeviceName.isGood(words(R.id.device))) {
      say(getString(R.string.device_wrong));
      return;
    }
    if (loadedWidthM != widthM()) { // it was changed since; without a folder there is nothing to load
      loadLandmarks();
    }
    if (loading || service == null) {
      say(getString(R.string.landmarks_loading));
      return;
    }
    String doubts = doubts();
    if (doubts.isEmpty()) {
      begin(floor);
      return;
    }
    new AlertDialog.Builder(this).setMessage(doubts + getString(R.string.start_question))
        .setNegativeButton(android.R.string.cancel, null).setPositiveButton(R.string.start, (dialog, which) -> begin(floor)).show();
  }

  /** What makes the walk one that no position is known of; empty where nothing does. */
  private String doubts() {
    PhoneFacts facts = new PhoneLook(this).facts(landmarks);
    StringBuilder sentences = new StringBuilder();
    for (Problem problem : facts.problems()) {
      if (problem.isAskedAbout() && !withoutCamera()) {
        sentences.append(getString(problem.sentence, facts.names(problem))).append("\n\n");
      }
    }
    return sentences.toString();
  }

  private void begin(int floor) {
    try {
      service.start(new Plan(place.site(), floor, words(R.id.device), words(R.id.note), Choices.RATES_HZ[rate()], landmarks,
          !withoutCamera(), ((CheckBox) findViewById(R.id.for_developers)).isChecked(), new PhoneLook(this).facts(landmarks).events(withoutCamera())));
      startActivity(new Intent(this, RecordActivity.class));
    } catch (IOException e) {
      say(getString(R.string.cannot_write, e.getMessage()));
    }
  }

  private void say(String sentence) {
    runOnUiThread(() -> Toast.makeText(this, sentence, Toast.LENGTH_LONG).show());
  }

  private float widthM() {
    return Numbers.metres(words(R.id.width_cm), choices.widthM());
  }

  private boolean withoutCamera() {
    return ((CheckBox) findViewById(R.id.without_camera)).isChecked();
  }

  private int rate() {
    return Math.max(0, ((Spinner) findViewById(R.id.rate)).getSelectedItemPosition());
  }

  private String words(int id) {
    return ((EditText) findViewById(id)).getText().toString().trim();
  }

  private TextView text(int id) {
    return findViewById(id);
  }

  private void onClick(int id, Runnable action) {
    findViewById(id).setOnClickListener(view -> action.run());
  }
}
