package org.vislam2tag.app.recording;

import android.app.Notification;
import android.app.NotificationChannel;
import android.app.NotificationManager;
import android.app.PendingIntent;
import android.content.Context;
import android.content.Intent;
import android.net.Uri;
import android.provider.Settings;
import org.vislam2tag.app.R;
import org.vislam2tag.app.record.RecordActivity;
import org.vislam2tag.core.radio.Radio;

/** What the app tells outside its own screens: that a recording runs, and that something stopped. */
public final class Notices {
  /** The notice that a recording runs. */
  static final int RECORDING = 1;
  /** Of what stopped; one for each radio. */
  private static final int STOPPED = 2;
  /** The notice that sessions are sent. */
  public static final int SENDING = 8;
  private static final String RUNNING = "recording";
  private static final String TROUBLE = "trouble";
  private static final String OUTBOX = "outbox";

  private final Context context;
  private final NotificationManager notifications;

  public Notices(Context context) {
    this.context = context;
    notifications = (NotificationManager) context.getSystemService(Context.NOTIFICATION_SERVICE);
  }

  /** That a recording runs; a tap leads to its screen. */
  Notification recording() {
    channel(RUNNING, R.string.recording_channel, NotificationManager.IMPORTANCE_LOW);
    Intent screen = new Intent(context, RecordActivity.class).addFlags(Intent.FLAG_ACTIVITY_SINGLE_TOP);
    return new Notification.Builder(context, RUNNING).setContentTitle(context.getString(R.string.recording_notice))
        .setSmallIcon(R.drawable.ic_recording).setContentIntent(opening(screen)).setOngoing(true).build();
  }

  /** That sessions are sent; a tap leads to their list. */
  public Notification sending(Class<?> list) {
    channel(OUTBOX, R.string.sending_channel, NotificationManager.IMPORTANCE_LOW);
    return new Notification.Builder(context, OUTBOX).setContentTitle(context.getString(R.string.sending_notice))
        .setSmallIcon(R.drawable.ic_recording).setContentIntent(opening(new Intent(context, list))).setOngoing(true).build();
  }

  /** Tells that nothing is heard any more: with a sound, as the screen is off. A tap leads to the app's page of the settings. */
  void stopped(Radio radio) {
    channel(TROUBLE, R.string.trouble_channel, NotificationManager.IMPORTANCE_HIGH);
    String sentence = context.getString(radio == Radio.WIFI ? R.string.wifi_stopped : R.string.ble_stopped);
    String remedy = context.getString(R.string.stopped_remedy);
    Intent settings = new Intent(Settings.ACTION_APPLICATION_DETAILS_SETTINGS, Uri.fromParts("package", context.getPackageName(), null));
    notifications.notify(STOPPED + radio.ordinal(), new Notification.Builder(context, TROUBLE).setContentTitle(sentence)
        .setContentText(remedy).setStyle(new Notification.BigTextStyle().bigText(remedy)).setSmallIcon(R.drawable.ic_recording)
        .setAutoCancel(true).setContentIntent(opening(settings)).build());
  }

  private void channel(String id, int name, int importance) {
    notifications.createNotificationChannel(new NotificationChannel(id, context.getString(name), importance));
  }

  private PendingIntent opening(Intent page) {
    return PendingIntent.getActivity(context, 0, page, PendingIntent.FLAG_IMMUTABLE);
  }
}
