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
import android.widget.TextView;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.Locale;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.ar.LandmarkImages;
import org.vislam2tag.app.record.RecordActivity;
import org.vislam2tag.app.recording.Plan;
import org.vislam2tag.app.recording.RecordingService;

/** The app's screens, laid out by Android's own views with Roboto's widths: nothing is cut off on the screens of usual phones. */
public class LayoutTest {
  private static final int[][] SIZES_DP = {{360, 640}, {360, 780}, {412, 915}};
  private static final int LEAST_PICTURE_DP = 96;

  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final List<String> faults = new ArrayList<>();
  private RecordingService.Link link;

  /** Something is done on a phone of each size, language and scale of the font. */
  private interface Look {
    void at(Phone phone) throws Exception;
  }

  private void onEveryPhone(Look look) throws Exception {
    for (int[] size : SIZES_DP) {
      for (Locale language : Arrays.asList(Locale.ENGLISH, Locale.GERMAN)) {
        for (float scale : new float[] {1, 1.3f, 2}) {
          int before = faults.size();
          look.at(Phone.usual(folder.newFolder(), size[0], size[1], scale, language));
          String phone = size[0] + " x " + size[1] + " " + language + " " + scale + ": ";
          faults.subList(before, faults.size()).replaceAll(fault -> phone + fault);
        }
      }
    }
    assertEquals(String.join("\n", faults), 0, faults.size());
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


  /** Adds what is wrong with a record screen; its status is seen without scrolling where that is asked for. */
  private void check(Screen<RecordActivity> screen, boolean isStatusSeen) {
    LaidOut laid = screen.laidOut();
    faults.addAll(laid.faults());
    ViewGroup status = screen.activity.findViewById(R.id.status);
    if (isStatusSeen && status.getChildAt(0).getHeight() > status.getHeight()) {
      faults.add("the status is higher than what is seen of it: " + status.getChildAt(0).getHeight() + " > " + status.getHeight());
    }
    if (laid.heightDp(R.id.camera) < LEAST_PICTURE_DP) {
      faults.add("the picture has " + laid.heightDp(R.id.camera) + " dp");
    }
  }

  @Test public void theRecordScreenShowsAllOfItsStatus() throws Exception {
    onEveryPhone(phone -> {
      Screen<RecordActivity> screen = recording(phone, true);
      says(screen.activity, R.id.walk, R.string.status_walk, 25, 59L, 1250.0, 30.0);
      says(screen.activity, R.id.tracking, R.string.tracking_good);
      says(screen.activity, R.id.landmarks, R.string.status_landmarks, 12, "lobby-2", 30.0, 25.0);
      says(screen.activity, R.id.scans, R.string.status_scans, 120, 3400L, 12000L);
      says(screen.activity, R.id.supplies, R.string.status_supplies, 12.3, 100);
      check(screen, phone.fontScale() < 2);
      end(phone, screen);
    });
  }

  @Test public void theRecordScreenHoldsAllThatCanBeWrongAtOnce() throws Exception {
    onEveryPhone(phone -> {
      Screen<RecordActivity> screen = recording(phone, true);
      Activity activity = screen.activity;
      says(activity, R.id.walk, R.string.status_walk, 125, 59L, 11250.0, 30.0);
      says(activity, R.id.tracking, R.string.tracking_features);
      says(activity, R.id.landmarks, R.string.status_landmarks, 120, "stairs-east-12", 300.0, 250.0);
      set(activity, R.id.scans, activity.getString(R.string.status_scans, 1200, 34000L, 120000L) + ' '
          + activity.getString(R.string.status_throttled));
      says(activity, R.id.supplies, R.string.status_supplies, 12.3, 100);
      set(activity, R.id.hints, activity.getString(R.string.status_clock_changed, -600.0) + '\n'
          + activity.getString(R.string.calibrate_magnetometer));
      activity.findViewById(R.id.hints).setVisibility(View.VISIBLE);
      set(activity, R.id.warnings, activity.getString(R.string.warning_no_landmark) + '\n'
          + activity.getString(R.string.warning_tracking) + '\n' + activity.getString(R.string.warning_too_fast));
      activity.findViewById(R.id.warnings).setVisibility(View.VISIBLE);
      says(activity, R.id.control_point, R.string.control_point, 120);
      check(screen, phone.fontScale() == 1);
      end(phone, screen);
    });
  }

  @Test public void thePlanOfAWalkWithoutCameraIsWide() throws Exception {
    onEveryPhone(phone -> {
      Screen<RecordActivity> screen = recording(phone, false);
      check(screen, phone.fontScale() < 2);
      View plan = screen.activity.findViewById(R.id.camera);
      if (plan.getWidth() < ((View) plan.getParent()).getWidth()) {
        faults.add("the plan is not as wide as the screen");
      }
      end(phone, screen);
    });
  }
}
