package org.vislam2tag.app.sessions;

import android.app.Service;
import android.content.Context;
import android.content.Intent;
import android.content.pm.ServiceInfo;
import android.os.Binder;
import android.os.Build;
import android.os.Handler;
import android.os.IBinder;
import android.os.Looper;
import android.os.PowerManager;
import java.io.File;
import java.io.IOException;
import org.vislam2tag.app.R;
import org.vislam2tag.app.recording.Notices;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.core.handover.Outbox;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.SendAll;
import org.vislam2tag.core.handover.UploadException;
import org.vislam2tag.core.session.StoredSession;

/** Sends what waits in the outbox, also while the screen is off or another app is in front. */
public final class UploadService extends Service {
  private static final long LONGEST_MS = 3600 * 1000;
  private static Outbox outbox;

  /** What the screen holds of the service. */
  final class Link extends Binder {
    /** Of the session that is being sent, 0 to 1; negative while none is. */
    float done() {
      return done;
    }

    /** Why sending ended before all was sent; empty where it did not. */
    String trouble() {
      return trouble;
    }

    /** Ends sending; what waits stays marked so. */
    void stop() {
      if (sender != null) {
        sender.stop();
      }
    }
  }

  private volatile SendAll sender;
  private volatile float done = -1;
  private volatile String trouble = "";

  /** The app's outbox, one for all. */
  static synchronized Outbox outbox(Context context) {
    if (outbox == null) {
      outbox = new Outbox(new File(context.getFilesDir(), "outbox.json"));
    }
    return outbox;
  }

  /** Sends what waits; also what a sending that was ended has left. */
  static void start(Context context) {
    context.startForegroundService(new Intent(context, UploadService.class));
  }

  @Override public IBinder onBind(Intent intent) {
    return new Link();
  }

  /** Where Android ended the service for want of memory, it begins it again, and sending goes on. */
  @Override public int onStartCommand(Intent intent, int flags, int startId) {
    try {
      goForeground();
    } catch (RuntimeException e) { // Android does not let it: what waits is sent when the list is looked at again
      stopSelf();
      return START_NOT_STICKY;
    }
    if (sender == null) {
      sender = new SendAll(outbox(this), this::send);
      new Thread(this::work, "send").start();
    }
    return START_STICKY;
  }

  @Override public void onDestroy() {
    if (sender != null) {
      sender.stop();
    }
    super.onDestroy();
  }

  private void goForeground() {
    if (Build.VERSION.SDK_INT >= Build.VERSION_CODES.Q) {
      startForeground(Notices.SENDING, new Notices(this).sending(SessionsActivity.class),
          ServiceInfo.FOREGROUND_SERVICE_TYPE_CONNECTED_DEVICE);
    } else {
      startForeground(Notices.SENDING, new Notices(this).sending(SessionsActivity.class));
    }
  }

  private void work() {
    PowerManager.WakeLock awake =
        ((PowerManager) getSystemService(POWER_SERVICE)).newWakeLock(PowerManager.PARTIAL_WAKE_LOCK, "vislam2tag:sending");
    awake.acquire(LONGEST_MS);
    trouble = "";
    try {
      sender.run();
    } catch (UploadException e) {
      trouble = new SessionText(this::getString).of(e);
    } catch (IOException e) {
      trouble = getString(R.string.cannot_write, e.getMessage());
    } catch (InterruptedException e) {
      Thread.currentThread().interrupt();
    } finally {
      awake.release();
      new Handler(Looper.getMainLooper()).post(this::over);
    }
  }

  private void over() {
    boolean more = !sender.isStopped() && trouble.isEmpty() && !outbox(this).waiting().isEmpty();
    sender = null;
    if (more) { // put there since the last look
      start(this);
      return;
    }
    stopForeground(true);
    stopSelf();
  }

  private String send(Receiver to, String name) throws UploadException, IOException, InterruptedException {
    HandOver handOver = new HandOver(this);
    done = 0;
    try {
      for (StoredSession session : RecordingService.endedSessions(this)) {
        if (session.folder.getName().equals(name)) {
          File zip = handOver.pack(session, (bytes, of) -> {});
          return handOver.send(zip, to, (bytes, of) -> {
            done = of > 0 ? (float) bytes / of : 1;
            return !sender.isStopped();
          });
        }
      }
      return null;
    } finally {
      done = -1;
    }
  }
}
