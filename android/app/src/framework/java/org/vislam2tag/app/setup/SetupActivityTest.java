package org.vislam2tag.app.setup;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNotNull;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;

import android.app.Phone;
import android.app.Screen;
import android.content.Intent;
import android.widget.CheckBox;
import android.widget.TextView;
import java.io.File;
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
}
