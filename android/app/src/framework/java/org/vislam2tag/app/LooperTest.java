package org.vislam2tag.app;

import static org.junit.Assert.assertEquals;

import android.app.Phone;
import android.os.Handler;
import android.os.HandlerThread;
import android.os.Looper;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.concurrent.CountDownLatch;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;

/** The main loop that the other tests of this folder stand on. */
public class LooperTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();

  @Test public void whatIsPostedHappensInTheOrderOfItsTime() throws Exception {
    Phone phone = Phone.usual(folder.getRoot());
    List<String> done = new ArrayList<>();
    Handler handler = new Handler(Looper.getMainLooper());
    handler.postDelayed(() -> done.add("in a minute"), 60_000);
    handler.post(() -> done.add("now"));
    phone.idle();
    assertEquals(Arrays.asList("now"), done);
    phone.pass(60_000);
    assertEquals(Arrays.asList("now", "in a minute"), done);
  }

  @Test public void anotherThreadIsWokenByAMessage() throws Exception {
    Phone.usual(folder.getRoot());
    HandlerThread thread = new HandlerThread("another");
    thread.start();
    CountDownLatch came = new CountDownLatch(1);
    new Handler(thread.getLooper()).post(came::countDown);
    came.await();
    thread.quitSafely();
    thread.join();
  }
}
