package org.vislam2tag.app;

import static org.junit.Assert.assertEquals;

import android.app.Activity;
import android.app.LaidOut;
import android.app.Phone;
import android.app.Screen;
import android.content.ComponentName;
import android.content.Context;
import android.content.Intent;
import android.content.ServiceConnection;
import android.os.IBinder;
import android.view.View;
import android.view.ViewGroup;
import android.widget.LinearLayout;
import android.widget.TextView;
import java.io.File;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.Locale;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.about.AboutActivity;
import org.vislam2tag.app.ar.LandmarkImages;
import org.vislam2tag.app.record.RecordActivity;
import org.vislam2tag.app.recording.Plan;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.app.sessions.Outboxes;
import org.vislam2tag.app.sessions.SessionsActivity;
import org.vislam2tag.app.setup.SetupActivity;
import org.vislam2tag.app.setup.UnlockActivity;

/** The app's screens, laid out by Android's own views with Roboto's widths: nothing is cut off on the screens of usual phones. */
public class LayoutTest {
  private static final int[][] SIZES_DP = {{360, 640}, {360, 780}, {412, 915}};
  private static final float DRAWN_SCALE = 1.3f;
  private static final float[] SCALES = {1, DRAWN_SCALE};
  /** On the smallest screen only, where the status scrolls and long words break. */
  private static final float LARGEST_SCALE = 2;
  private static final int LEAST_PICTURE_DP = 96;

  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final List<String> faults = new ArrayList<>();
  private RecordingService.Link link;

  /** Something is done on a phone of each size, language and scale of the font. */
  private interface Look {
    void at(Phone phone) throws Exception;
  }

  private void onEveryPhone(Look look) throws Exception {
    for (Locale language : Arrays.asList(Locale.US, Locale.GERMANY)) {
      for (int[] size : SIZES_DP) {
        for (float scale : SCALES) {
          look(look, size, scale, language);
        }
      }
      look(look, SIZES_DP[0], LARGEST_SCALE, language);
    }
    assertEquals(String.join("\n", faults), 0, faults.size());
  }

  private void look(Look look, int[] size, float scale, Locale language) throws Exception {
    int before = faults.size();
    Phone phone = Phone.usual(folder.newFolder(), size[0], size[1], scale, language);
    look.at(phone);
    faults.subList(before, faults.size()).replaceAll(fault -> phone.name() + ": " + fault);
  }

  /** Adds what is wrong with a screen, and draws it where the font is large. */
  private LaidOut check(Phone phone, Screen<?> screen, String name) throws Exception {
    LaidOut laid = screen.laidOut();
    laid.faults(phone.fontScale() == LARGEST_SCALE).forEach(fault -> faults.add(name + ": " + fault));
    if (phone.fontScale() == DRAWN_SCALE) {
      laid.draw(new File(System.getProperty("framework.screens"), name + "_" + phone.name() + ".png"));
    }
    return laid;
  }

  private Screen<RecordActivity> recording(Phone phone, boolean withCamera) throws Exception {
    phone.context().bindService(new Intent(phone.context(), RecordingService.class), new ServiceConnection() {
      @Override public void onServiceConnected(ComponentName name, IBinder binder) {
        link = (RecordingService.Link) binder;
      }

      @Override public void onServiceDisconnected(ComponentName name) {}
    }, Context.BIND_AUTO_CREATE);
    phone.idle();
    link.start(new Plan("Site", 0, "LG", "", 100, LandmarkImages.none(), withCamera, false, Collections.emptyList()));
    Screen<RecordActivity> screen = phone.open(RecordActivity.class, new Intent()).show();
    phone.idle();
    return screen;
  }

  private void end(Phone phone, Screen<RecordActivity> screen) throws Exception {
    screen.pause().stop().destroy();
    link.stop();
    phone.until("the recording's end", () -> link.recording() == null);
  }

  private static void says(Activity screen, int id, int sentence, Object... parts) {
    set(screen, id, screen.getString(sentence, parts));
  }

  private static void set(Activity screen, int id, String words) {
    ((TextView) screen.findViewById(id)).setText(words);
  }

  /** A record screen's status is seen without scrolling where that is asked for. */
  private void checkRecord(Phone phone, Screen<RecordActivity> screen, String name, boolean isStatusSeen) throws Exception {
    LaidOut laid = check(phone, screen, name);
    ViewGroup status = screen.activity.findViewById(R.id.status);
    if (isStatusSeen && status.getChildAt(0).getHeight() > status.getHeight()) {
      faults.add(name + ": of the status' " + status.getChildAt(0).getHeight() + " pixels " + status.getHeight() + " are seen");
    }
    if (laid.heightDp(R.id.camera) < LEAST_PICTURE_DP) {
      faults.add(name + ": the picture has " + laid.heightDp(R.id.camera) + " dp");
    }
  }

  @Test public void theRecordScreenShowsAllOfItsStatus() throws Exception {
    onEveryPhone(phone -> {
      Screen<RecordActivity> screen = recording(phone, true);
      Activity activity = screen.activity;
      says(activity, R.id.walk, R.string.status_walk, 25, 59L, 1250.0, 30.0);
      says(activity, R.id.tracking, R.string.tracking_good);
      says(activity, R.id.landmarks, R.string.status_landmarks, 12, "lobby-2", 30.0, 25.0);
      says(activity, R.id.scans, R.string.status_scans, 120, 3400L, 12000L);
      says(activity, R.id.supplies, R.string.status_supplies, 12.3, 100);
      checkRecord(phone, screen, "record", phone.fontScale() < LARGEST_SCALE);
      sayAllThatCanBeWrong(activity);
      checkRecord(phone, screen, "record_warned", phone.fontScale() == 1);
      end(phone, screen);
    });
  }

  private static void sayAllThatCanBeWrong(Activity activity) {
    says(activity, R.id.tracking, R.string.tracking_features);
    says(activity, R.id.landmarks, R.string.status_landmarks, 120, "stairs-east-12", 300.0, 250.0);
    set(activity, R.id.scans, activity.getString(R.string.status_scans, 1200, 34000L, 120000L) + ' '
        + activity.getString(R.string.status_throttled));
    set(activity, R.id.hints, activity.getString(R.string.status_clock_changed, -600.0) + '\n'
        + activity.getString(R.string.calibrate_magnetometer));
    set(activity, R.id.warnings, activity.getString(R.string.warning_no_landmark) + '\n'
        + activity.getString(R.string.warning_tracking) + '\n' + activity.getString(R.string.warning_too_fast));
    activity.findViewById(R.id.hints).setVisibility(View.VISIBLE);
    activity.findViewById(R.id.warnings).setVisibility(View.VISIBLE);
    says(activity, R.id.control_point, R.string.control_point, 120);
  }

  @Test public void thePlanOfAWalkWithoutCameraIsWide() throws Exception {
    onEveryPhone(phone -> {
      Screen<RecordActivity> screen = recording(phone, false);
      checkRecord(phone, screen, "record_plan", phone.fontScale() < LARGEST_SCALE);
      View plan = screen.activity.findViewById(R.id.camera);
      assertEquals(((View) plan.getParent()).getWidth(), plan.getWidth());
      end(phone, screen);
    });
  }

  @Test public void theFirstScreenHoldsItsProblems() throws Exception {
    onEveryPhone(phone -> {
      phone.granted.clear();
      Screen<SetupActivity> screen = phone.open(SetupActivity.class, new Intent()).show();
      phone.idle();
      screen.activity.findViewById(R.id.forget_site).setVisibility(View.VISIBLE);
      check(phone, screen, "setup");
      ViewGroup fields = (ViewGroup) screen.activity.findViewById(R.id.problems).getParent();
      ((View) fields.getParent()).scrollTo(0, fields.getHeight());
      check(phone, screen, "setup_below");
      screen.pause().stop().destroy();
    });
  }

  @Test public void theStepsThatUnlockScansAndWhatTheAppIsAreWhole() throws Exception {
    onEveryPhone(phone -> {
      phone.granted.clear();
      for (Class<? extends Activity> type : Arrays.asList(UnlockActivity.class, AboutActivity.class)) {
        Screen<? extends Activity> screen = phone.open(type, new Intent()).show();
        check(phone, screen, type.getSimpleName().replace("Activity", "").toLowerCase(Locale.ROOT));
        screen.pause().stop().destroy();
      }
    });
  }

  @Test public void theListOfSessionsIsWhole() throws Exception {
    onEveryPhone(phone -> {
      Outboxes.forget();
      new Recorded(new File(phone.files, "sessions")).recorder.stop();
      Screen<SessionsActivity> screen = phone.open(SessionsActivity.class, new Intent()).show();
      LinearLayout list = screen.activity.findViewById(R.id.list);
      phone.until("the list", () -> list.getChildCount() > 0);
      screen.activity.findViewById(R.id.working).setVisibility(View.VISIBLE);
      check(phone, screen, "sessions");
      screen.pause().stop().destroy();
    });
  }
}
