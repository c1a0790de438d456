package org.vislam2tag.app.setup;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;
import static org.mockito.ArgumentMatchers.any;
import static org.mockito.ArgumentMatchers.eq;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.when;

import android.Manifest;
import android.app.Phone;
import android.app.Screen;
import android.content.Intent;
import android.content.pm.PackageManager;
import android.provider.Settings;
import android.view.View;
import android.widget.CheckBox;
import android.widget.TextView;
import com.google.ar.core.ArCoreApk;
import com.google.ar.core.ArCoreApk.Availability;
import com.google.ar.core.ArCoreApk.InstallStatus;
import com.google.ar.core.exceptions.FatalException;
import com.google.ar.core.exceptions.UnavailableUserDeclinedInstallationException;
import java.io.File;
import java.util.Arrays;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.R;
import org.vislam2tag.app.record.RecordActivity;
import org.vislam2tag.app.recording.RecordingService;

/** The first screen on Android's own classes. */
public class SetupActivityTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private Phone phone;
  private Screen<SetupActivity> screen;

  @Before public void open() throws Exception {
    phone = Phone.usual(folder.getRoot());
    screen = phone.open(SetupActivity.class, new Intent()).show();
    phone.idle();
  }

  private File[] sessions() {
    return new File(folder.getRoot(), "sessions").listFiles(File::isDirectory);
  }

  private void walkWithoutCamera() {
    ((CheckBox) screen.activity.findViewById(R.id.without_camera)).setChecked(true);
  }

  @Test public void twoTapsOnStartMakeOneRecording() throws Exception {
    walkWithoutCamera();
    screen.click(R.id.start);
    screen.click(R.id.start);
    phone.idle();
    assertEquals(1, sessions().length);
    assertEquals(RecordActivity.class.getName(), phone.lastStarted().getComponent().getClassName());
  }

  @Test public void aScreenMadeAnewStartsOneRecordingAndKeepsWhatWasTyped() throws Exception {
    ((TextView) screen.activity.findViewById(R.id.site)).setText("Main building");
    screen = screen.recreate();
    phone.idle();
    assertEquals("Main building", ((TextView) screen.activity.findViewById(R.id.site)).getText().toString());
    walkWithoutCamera();
    screen.click(R.id.start);
    phone.idle();
    assertEquals(1, sessions().length);
  }

  @Test public void withoutArCoreAStartIsAskedAbout() throws Exception {
    arCore(Availability.UNSUPPORTED_DEVICE_NOT_CAPABLE);
    screen.click(R.id.start);
    assertTrue(phone.question(), phone.question().contains(screen.activity.getString(R.string.problem_no_arcore)));
    phone.answer(android.R.id.button2);
    assertEquals(0, sessions().length);
    screen.click(R.id.start);
    phone.answer(android.R.id.button1);
    assertEquals(1, sessions().length);
  }

  @Test public void whoDeclinesArCoreOrAsksTooOftenIsTold() throws Exception {
    ArCoreApk arCore = arCore(Availability.SUPPORTED_APK_TOO_OLD);
    when(arCore.requestInstall(any(), eq(true))).thenReturn(InstallStatus.INSTALL_REQUESTED)
        .thenThrow(new FatalException("too frequently"));
    when(arCore.requestInstall(any(), eq(false))).thenThrow(new UnavailableUserDeclinedInstallationException());
    View install = screen.activity.findViewById(R.id.problems).findViewById(R.id.fix);
    install.performClick();
    screen.pause().resume();
    install.performClick();
    assertEquals(Arrays.asList(screen.activity.getString(R.string.arcore_declined),
        screen.activity.getString(R.string.arcore_try_again)), phone.toasts());
  }

  @Test public void aPermissionRefusedForGoodLeadsToTheSettings() throws Exception {
    phone.granted.clear();
    screen.permissions(2, new String[] {Manifest.permission.CAMERA}, new int[] {PackageManager.PERMISSION_DENIED});
    assertEquals(Settings.ACTION_APPLICATION_DETAILS_SETTINGS, phone.lastStarted().getAction());
  }

  private ArCoreApk arCore(Availability known) throws Exception {
    ArCoreApk.instance = mock(ArCoreApk.class);
    when(ArCoreApk.instance.checkAvailability(any())).thenReturn(known);
    screen = screen.recreate();
    phone.idle();
    return ArCoreApk.instance;
  }
}
