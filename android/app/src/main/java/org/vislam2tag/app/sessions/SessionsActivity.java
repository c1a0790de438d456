package org.vislam2tag.app.sessions;

import android.app.Activity;
import android.app.AlertDialog;
import android.content.ComponentName;
import android.content.Intent;
import android.content.ServiceConnection;
import android.os.Bundle;
import android.os.Handler;
import android.os.IBinder;
import android.os.Looper;
import android.view.View;
import android.widget.EditText;
import android.widget.LinearLayout;
import android.widget.ProgressBar;
import android.widget.TextView;
import android.widget.Toast;
import java.io.File;
import java.io.IOException;
import java.util.ArrayList;
import java.util.Collections;
import java.util.HashSet;
import java.util.List;
import java.util.Set;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;
import java.util.concurrent.atomic.AtomicBoolean;
import java.util.stream.Collectors;
import org.vislam2tag.app.R;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.app.scan.ScanActivity;
import org.vislam2tag.core.handover.Outbox;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.UploadException;
import org.vislam2tag.core.session.SessionStore;
import org.vislam2tag.core.session.StoredSession;

/** The sessions on the phone: share them as zip, send them to the computer, delete them. Links of the computer open it. */
public final class SessionsActivity extends Activity implements ServiceConnection {
  private static final int PARTS = 1000;
  private static final int SCAN = 1;
  private static final long LOOK_MS = 500;

  private final ExecutorService work = Executors.newSingleThreadExecutor();
  private final AtomicBoolean stopped = new AtomicBoolean();
  /** Addresses of computers that the collector agreed to send to. */
  private final Set<String> agreed = new HashSet<>();
  private final SessionText text = new SessionText(this::getString);
  private final Handler handler = new Handler(Looper.getMainLooper());
  private final Runnable look = this::look;
  private final List<String> shown = new ArrayList<>();
  private List<String> lastWaiting = new ArrayList<>();
  private String lastTrouble = "";
  private SessionStore store;
  private Outbox outbox;
  private UploadService.Link uploads;
  private HandOver handOver;

  @Override protected void onCreate(Bundle saved) {
    super.onCreate(saved);
    setContentView(R.layout.sessions);
    store = new SessionStore(RecordingService.sessions(this));
    handOver = new HandOver(this);
    outbox = UploadService.outbox(this);
    bindService(new Intent(this, UploadService.class), this, BIND_AUTO_CREATE);
    findViewById(R.id.cancel).setOnClickListener(view -> cancel());
    findViewById(R.id.send_all).setOnClickListener(view -> sendAll());
    findViewById(R.id.scan).setOnClickListener(view -> startActivityForResult(new Intent(this, ScanActivity.class), SCAN));
    fill(getIntent());
    list();
  }

  @Override protected void onNewIntent(Intent intent) {
    super.onNewIntent(intent);
    fill(intent);
  }

  /** What a sending that was ended has left goes on. */
  @Override protected void onResume() {
    super.onResume();
    if (!outbox.waiting().isEmpty()) {
      UploadService.start(this);
    }
    handler.post(look);
  }

  @Override protected void onPause() {
    handler.removeCallbacks(look);
    super.onPause();
  }

  @Override protected void onDestroy() {
    unbindService(this);
    stopped.set(true);
    work.shutdown();
    super.onDestroy();
  }

  /** A code is what a link is; one of something else is said at once. */
  @Override protected void onActivityResult(int request, int result, Intent answer) {
    if (request != SCAN || result != RESULT_OK || answer == null) {
      return;
    }
    String text = answer.getStringExtra(ScanActivity.TEXT);
    try {
      say(getString(R.string.scan_found, Receiver.ofLink(text).address()));
      field(R.id.receiver).setText(text);
    } catch (IllegalArgumentException e) {
      say(getString(R.string.scan_other));
    }
  }

  /** A link of {@code vislam2tag receive} fills address and token in. */
  private void fill(Intent intent) {
    if (intent.getData() != null) {
      field(R.id.receiver).setText(intent.getData().toString());
    }
  }

  private void list() {
    run(() -> {
      List<StoredSession> sessions = RecordingService.endedSessions(this);
      runOnUiThread(() -> show(sessions));
    });
  }

  private void show(List<StoredSession> sessions) {
    LinearLayout list = findViewById(R.id.list);
    list.removeAllViews();
    shown.clear();
    findViewById(R.id.none).setVisibility(sessions.isEmpty() ? View.VISIBLE : View.GONE);
    for (StoredSession session : sessions) {
      String name = session.folder.getName();
      shown.add(name);
      View row = getLayoutInflater().inflate(R.layout.session, list, false);
      ((TextView) row.findViewById(R.id.name)).setText(name);
      ((TextView) row.findViewById(R.id.about_session)).setText(text.of(session, outbox));
      row.findViewById(R.id.share).setOnClickListener(view -> share(session));
      row.findViewById(R.id.send).setOnClickListener(view -> send(Collections.singletonList(name)));
      row.findViewById(R.id.delete).setOnClickListener(view -> confirmDelete(session));
      list.addView(row);
    }
  }

  private void share(StoredSession session) {
    run(() -> {
      File zip = handOver.pack(session, this::packed);
      Intent share = new Intent(Intent.ACTION_SEND).setType(SessionZipProvider.TYPE)
          .putExtra(Intent.EXTRA_STREAM, SessionZipProvider.address(this, zip)).addFlags(Intent.FLAG_GRANT_READ_URI_PERMISSION);
      runOnUiThread(() -> startActivity(Intent.createChooser(share, zip.getName())));
    });
  }

  /** Sends these sessions in the background, once the collector agreed to the computer. */
  private void send(List<String> sessions) {
    Receiver receiver;
    try {
      receiver = Receivers.of(field(R.id.receiver).getText().toString(), field(R.id.token).getText().toString());
    } catch (IllegalArgumentException e) {
      say(getString(R.string.receiver_wrong));
      return;
    }
    if (agreed.contains(receiver.address())) {
      send(sessions, receiver);
    } else {
      confirmReceiver(sessions, receiver);
    }
  }

  /** Any page or message can hold a link that names another computer. */
  private void confirmReceiver(List<String> sessions, Receiver receiver) {
    new AlertDialog.Builder(this).setMessage(getString(R.string.receiver_question, receiver.address()))
        .setNegativeButton(android.R.string.cancel, null)
        .setPositiveButton(R.string.send, (dialog, which) -> {
          agreed.add(receiver.address());
          send(sessions, receiver);
        }).show();
  }

  private void send(List<String> sessions, Receiver receiver) {
    try {
      outbox.send(receiver, sessions);
      UploadService.start(this);
    } catch (IOException e) {
      say(getString(R.string.cannot_write, e.getMessage()));
    }
    list();
  }

  private void sendAll() {
    List<String> unsent = shown.stream().filter(name -> outbox.filedAt(name) == null).collect(Collectors.toList());
    if (unsent.isEmpty()) {
      say(getString(R.string.all_sent));
    } else {
      send(unsent);
    }
  }

  /** Ends what is being sent or packed. */
  private void cancel() {
    stopped.set(true);
    try {
      outbox.cancel();
    } catch (IOException e) {
      say(getString(R.string.cannot_write, e.getMessage()));
    }
    if (uploads != null) {
      uploads.stop();
    }
  }

  /** Shows how far sending is, and what became of it. */
  private void look() {
    List<String> waiting = outbox.waiting();
    if (uploads != null && uploads.done() >= 0) {
      findViewById(R.id.working).setVisibility(View.VISIBLE);
      progress(Math.round(PARTS * uploads.done()), PARTS);
    }
    if (!waiting.equals(lastWaiting)) {
      lastWaiting = waiting;
      findViewById(R.id.working).setVisibility(waiting.isEmpty() ? View.GONE : View.VISIBLE);
      list();
    }
    String trouble = uploads == null ? "" : uploads.trouble();
    if (!trouble.equals(lastTrouble)) {
      lastTrouble = trouble;
      if (!trouble.isEmpty()) {
        findViewById(R.id.working).setVisibility(View.GONE);
        say(trouble);
      }
    }
    handler.postDelayed(look, LOOK_MS);
  }

  @Override public void onServiceConnected(ComponentName name, IBinder link) {
    uploads = (UploadService.Link) link;
  }

  @Override public void onServiceDisconnected(ComponentName name) {
    uploads = null;
  }

  private void confirmDelete(StoredSession session) {
    new AlertDialog.Builder(this).setMessage(getString(R.string.delete_question, session.folder.getName()))
        .setNegativeButton(android.R.string.cancel, null)
        .setPositiveButton(R.string.delete, (dialog, which) -> run(() -> {
          store.delete(session);
          handOver.forget(session);
          outbox.forget(session.folder.getName());
          runOnUiThread(this::list);
        })).show();
  }

  /** A piece of work with files and network. */
  private interface Job {
    void run() throws IOException, UploadException, InterruptedException;
  }

  private void run(Job job) {
    if (isDestroyed()) {
      return; // the screen was left while something was deleted
    }
    stopped.set(false);
    findViewById(R.id.working).setVisibility(View.VISIBLE);
    work.execute(() -> {
      try {
        job.run();
      } catch (UploadException e) {
        say(text.of(e));
      } catch (IOException e) {
        say(getString(R.string.cannot_write, e.getMessage()));
      } catch (InterruptedException e) {
        Thread.currentThread().interrupt();
      }
      runOnUiThread(() -> findViewById(R.id.working).setVisibility(View.GONE));
    });
  }

  private void packed(long bytes, long ofBytes) throws IOException {
    progress(bytes, ofBytes);
    if (stopped.get()) {
      throw new IOException(getString(R.string.upload_cancelled));
    }
  }

  private void progress(long bytes, long ofBytes) {
    int part = ofBytes > 0 ? (int) (PARTS * bytes / ofBytes) : PARTS;
    runOnUiThread(() -> ((ProgressBar) findViewById(R.id.progress)).setProgress(part));
  }

  private void say(String sentence) {
    runOnUiThread(() -> Toast.makeText(this, sentence, Toast.LENGTH_LONG).show());
  }

  private EditText field(int id) {
    return findViewById(id);
  }
}
