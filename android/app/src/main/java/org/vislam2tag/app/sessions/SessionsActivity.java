package org.vislam2tag.app.sessions;

import android.app.Activity;
import android.app.AlertDialog;
import android.content.Intent;
import android.os.Bundle;
import android.view.View;
import android.widget.EditText;
import android.widget.LinearLayout;
import android.widget.ProgressBar;
import android.widget.TextView;
import android.widget.Toast;
import java.io.File;
import java.io.IOException;
import java.util.HashSet;
import java.util.List;
import java.util.Set;
import java.util.concurrent.ExecutorService;
import java.util.concurrent.Executors;
import java.util.concurrent.atomic.AtomicBoolean;
import org.vislam2tag.app.R;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.app.scan.ScanActivity;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.UploadException;
import org.vislam2tag.core.session.SessionStore;
import org.vislam2tag.core.session.StoredSession;

/** The sessions on the phone: share them as zip, send them to the computer, delete them. Links of the computer open it. */
public final class SessionsActivity extends Activity {
  private static final int PARTS = 1000;
  private static final int SCAN = 1;

  private final ExecutorService work = Executors.newSingleThreadExecutor();
  private final AtomicBoolean stopped = new AtomicBoolean();
  /** Addresses of computers that the collector agreed to send to. */
  private final Set<String> agreed = new HashSet<>();
  private final SessionText text = new SessionText(this::getString);
  private SessionStore store;
  private HandOver handOver;

  @Override protected void onCreate(Bundle saved) {
    super.onCreate(saved);
    setContentView(R.layout.sessions);
    store = new SessionStore(RecordingService.sessions(this));
    handOver = new HandOver(this);
    findViewById(R.id.cancel).setOnClickListener(view -> stopped.set(true));
    findViewById(R.id.scan).setOnClickListener(view -> startActivityForResult(new Intent(this, ScanActivity.class), SCAN));
    fill(getIntent());
    list();
  }

  @Override protected void onNewIntent(Intent intent) {
    super.onNewIntent(intent);
    fill(intent);
  }

  @Override protected void onDestroy() {
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
    findViewById(R.id.none).setVisibility(sessions.isEmpty() ? View.VISIBLE : View.GONE);
    for (StoredSession session : sessions) {
      View row = getLayoutInflater().inflate(R.layout.session, list, false);
      ((TextView) row.findViewById(R.id.name)).setText(session.folder.getName());
      ((TextView) row.findViewById(R.id.about_session)).setText(text.of(session));
      row.findViewById(R.id.share).setOnClickListener(view -> share(session));
      row.findViewById(R.id.send).setOnClickListener(view -> send(session));
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

  private void send(StoredSession session) {
    Receiver receiver;
    try {
      receiver = Receivers.of(field(R.id.receiver).getText().toString(), field(R.id.token).getText().toString());
    } catch (IllegalArgumentException e) {
      say(getString(R.string.receiver_wrong));
      return;
    }
    if (agreed.contains(receiver.address())) {
      send(session, receiver);
    } else {
      confirmReceiver(session, receiver);
    }
  }

  /** Any page or message can hold a link that names another computer. */
  private void confirmReceiver(StoredSession session, Receiver receiver) {
    new AlertDialog.Builder(this).setMessage(getString(R.string.receiver_question, receiver.address()))
        .setNegativeButton(android.R.string.cancel, null)
        .setPositiveButton(R.string.send, (dialog, which) -> {
          agreed.add(receiver.address());
          send(session, receiver);
        }).show();
  }

  private void send(StoredSession session, Receiver receiver) {
    run(() -> {
      File zip = handOver.pack(session, this::packed);
      String filed = handOver.send(zip, receiver, (bytes, of) -> {
        progress(bytes, of);
        return !stopped.get();
      });
      say(getString(R.string.upload_filed, filed));
    });
  }

  private void confirmDelete(StoredSession session) {
    new AlertDialog.Builder(this).setMessage(getString(R.string.delete_question, session.folder.getName()))
        .setNegativeButton(android.R.string.cancel, null)
        .setPositiveButton(R.string.delete, (dialog, which) -> run(() -> {
          store.delete(session);
          handOver.forget(session);
          runOnUiThread(this::list);
        })).show();
  }

  /** A piece of work with files and network. */
  private interface Job {
    void run() throws IOException, UploadException, InterruptedException;
  }

  private void run(Job job) {
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
