package android.app;

import android.content.ComponentName;
import android.content.Intent;
import android.content.pm.ActivityInfo;
import android.os.Binder;
import android.os.Bundle;
import android.view.View;

/** An activity, and what Android does to it. */
public final class Screen<T extends Activity> {
  public final T activity;
  private final Phone phone;
  private final Intent intent;

  Screen(Phone phone, Class<T> type, Intent intent) throws Exception {
    this(phone, type, intent, null);
  }

  private Screen(Phone phone, Class<T> type, Intent intent, Activity.NonConfigurationInstances kept) throws Exception {
    this.phone = phone;
    this.intent = intent;
    activity = type.getConstructor().newInstance();
    ActivityInfo info = new ActivityInfo();
    info.applicationInfo = phone.app;
    info.packageName = phone.app.packageName;
    info.name = type.getName();
    Intent with = intent.getComponent() == null ? new Intent(intent).setComponent(new ComponentName(info.packageName, info.name)) : intent;
    PhoneContext context = new PhoneContext(phone);
    activity.attach(context, phone.thread, phone.thread.mInstrumentation, new Binder(), 1, phone.application, with, info, "", null,
        null, kept, phone.resources.getConfiguration(), null, null, null, null, new Binder());
    activity.setTheme(org.vislam2tag.app.R.style.App);
  }

  /** Brings it to the front for the first time. */
  public Screen<T> show(Bundle saved) {
    phone.thread.mInstrumentation.callActivityOnCreate(activity, saved);
    activity.performStart("");
    if (saved != null) {
      phone.thread.mInstrumentation.callActivityOnRestoreInstanceState(activity, saved);
    }
    activity.onPostCreate(saved);
    return resume();
  }

  public Screen<T> show() {
    return show(null);
  }

  public Screen<T> resume() {
    activity.performResume(false, "");
    return this;
  }

  public Screen<T> pause() {
    activity.performPause();
    return this;
  }

  /** Out of sight, as after the home key. */
  public Screen<T> stop() {
    activity.performStop(false, "");
    return this;
  }

  /** In sight again. */
  public Screen<T> restart() {
    activity.performRestart(true, "");
    return this;
  }

  public void destroy() {
    activity.performDestroy();
  }

  /** Ends it and makes it anew, as at a change of language or font. */
  @SuppressWarnings("unchecked")
  public Screen<T> recreate() throws Exception {
    Bundle saved = new Bundle();
    pause();
    activity.performSaveInstanceState(saved);
    stop();
    Activity.NonConfigurationInstances kept = activity.retainNonConfigurationInstances();
    destroy();
    return new Screen<>(phone, (Class<T>) activity.getClass(), intent, kept).show(saved);
  }

  /** Its views, each in its place. */
  public LaidOut laidOut() {
    return new LaidOut(activity);
  }

  /** The answer of another screen. */
  public void result(int request, int result, Intent answer) {
    activity.dispatchActivityResult(null, request, result, answer, "");
  }

  /** The collector's answer to Android's question. */
  public void permissions(int request, String[] permissions, int[] given) {
    activity.onRequestPermissionsResult(request, permissions, given);
  }

  public void newIntent(Intent with) {
    activity.performNewIntent(with);
  }

  public void click(int id) {
    View view = activity.findViewById(id);
    if (!view.performClick()) {
      throw new AssertionError("nothing happens at a click");
    }
  }
}
