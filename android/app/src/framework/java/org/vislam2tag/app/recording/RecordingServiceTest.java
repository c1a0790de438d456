package org.vislam2tag.app.recording;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNotNull;
import static org.junit.Assert.assertNull;

import android.app.Phone;
import android.content.ComponentName;
import android.content.Context;
import android.content.Intent;
import android.content.ServiceConnection;
import android.os.IBinder;
import java.io.File;
import java.util.Collections;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.ar.LandmarkImages;
import org.vislam2tag.core.session.SessionEnd;

/** The service on Android's own main loop, started and bound as by its screens. */
public class RecordingServiceTest {
  private static final Plan PLAN = new Plan("Site", 0, "LG", "", 100, LandmarkImages.none(), false, false,
      Collections.emptyList());

  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private Phone phone;
  private Intent intent;
  private RecordingService.Link link;

  private final ServiceConnection screen = new ServiceConnection() {
    @Override public void onServiceConnected(ComponentName name, IBinder binder) {
      link = (RecordingService.Link) binder;
    }

    @Override public void onServiceDisconnected(ComponentName name) {
      link = null;
    }
  };

  @Before public void bind() throws Exception {
    phone = Phone.usual(folder.getRoot());
    intent = new Intent(phone.context(), RecordingService.class);
    phone.context().bindService(intent, screen, Context.BIND_AUTO_CREATE);
    phone.idle();
  }

  private File[] sessions() {
    return new File(folder.getRoot(), "sessions").listFiles(File::isDirectory);
  }

  private SessionEnd stopped() throws InterruptedException {
    link.stop();
    phone.until("the session's end", () -> link.recording() == null);
    return link.lastEnd();
  }

  @Test public void twoStartsMakeOneRecordingThatStopEnds() throws Exception {
    link.start(PLAN);
    Recording first = link.recording();
    link.start(PLAN);
    phone.idle();
    assertEquals(first, link.recording());
    assertEquals(1, sessions().length);
    assertEquals("stopped", stopped().state.word());
  }

  @Test public void theServiceOutlivesItsScreenAndEndsWithTheRecording() throws Exception {
    link.start(PLAN);
    phone.context().unbindService(screen);
    phone.idle();
    assertNotNull(phone.running(RecordingService.class));
    stopped();
    phone.idle();
    assertNull(phone.running(RecordingService.class));
  }
}
