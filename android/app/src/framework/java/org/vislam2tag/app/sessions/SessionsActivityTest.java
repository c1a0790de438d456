package org.vislam2tag.app.sessions;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;

import android.app.Phone;
import android.app.Screen;
import android.content.Intent;
import android.database.Cursor;
import android.net.Uri;
import android.provider.OpenableColumns;
import android.widget.LinearLayout;
import java.io.File;
import java.nio.file.Files;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.app.R;
import org.vislam2tag.app.Recorded;

/** The list of sessions on Android's own classes. */
public class SessionsActivityTest {
  private static final String LINK = "vislam2tag://127.0.0.1:9/#ABCDEFGHIJKLMNOP";

  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private Phone phone;

  @Before public void recordOne() throws Exception {
    phone = Phone.usual(folder.getRoot());
    Outboxes.forget();
    new Recorded(folder.newFolder("sessions")).recorder.stop();
  }

  private Screen<SessionsActivity> opened(Intent intent) throws Exception {
    Screen<SessionsActivity> screen = phone.open(SessionsActivity.class, intent).show();
    LinearLayout list = screen.activity.findViewById(R.id.list);
    phone.until("the list", () -> list.getChildCount() > 0);
    return screen;
  }

  @Test public void aLinkOfAPageSendsNothingBeforeTheCollectorAgreed() throws Exception {
    Screen<SessionsActivity> screen = opened(new Intent(Intent.ACTION_VIEW, Uri.parse(LINK)));
    screen.click(R.id.send_all);
    assertTrue(phone.question(), phone.question().contains("127.0.0.1:9"));
    assertTrue(UploadService.outbox(phone.context()).waiting().isEmpty());
    phone.answer(android.R.id.button2);
    assertTrue(UploadService.outbox(phone.context()).waiting().isEmpty());
    screen.click(R.id.send_all);
    phone.answer(android.R.id.button1);
    assertEquals(1, UploadService.outbox(phone.context()).waiting().size());
  }

  @Test public void deletingEndsAfterTheScreenWasLeft() throws Exception {
    Screen<SessionsActivity> screen = opened(new Intent());
    screen.activity.findViewById(R.id.list).findViewById(R.id.delete).performClick();
    phone.answer(android.R.id.button1);
    screen.pause().stop().destroy();
    phone.until("the session is deleted", () -> new File(folder.getRoot(), "sessions").listFiles(File::isDirectory).length == 0);
    Thread.sleep(50);
    phone.idle();
  }

  @Test public void whatIsSharedIsTheZipsNameAndSizeInTheOrderAskedFor() throws Exception {
    SessionZipProvider provider = phone.provider(new SessionZipProvider(), "org.vislam2tag.app.zips");
    File zip = new File(SessionZipProvider.folder(phone.context()), "a.zip");
    Files.write(zip.toPath(), new byte[7]);
    Uri address = SessionZipProvider.address(phone.context(), zip);
    String[] columns = {OpenableColumns.SIZE, "unknown", OpenableColumns.DISPLAY_NAME};
    try (Cursor rows = provider.query(address, columns, null, null, null)) {
      assertTrue(rows.moveToFirst());
      assertEquals(7, rows.getLong(0));
      assertTrue(rows.isNull(1));
      assertEquals("a.zip", rows.getString(2));
    }
    try (Cursor rows = provider.query(Uri.parse("content://org.vislam2tag.app.zips/..%2Fsessions"), null, null, null, null)) {
      assertEquals(0, rows.getCount());
    }
  }
}
