package org.vislam2tag.app.ar;

import static org.junit.Assert.assertArrayEquals;
import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNull;

import java.io.File;
import java.nio.file.Files;
import java.util.Collections;
import java.util.List;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.landmarks.Refusal;
import org.vislam2tag.core.landmarks.Refusal.Reason;

public class KeptImagesTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();
  private final List<Refusal> refused = Collections.singletonList(new Refusal("7", Reason.TRACKER, "ö"));

  @Test public void whatWasKeptIsThereAgain() {
    new KeptImages(new byte[] {1, 2, 3}, refused).keep(folder.getRoot(), "a");
    KeptImages kept = KeptImages.of(folder.getRoot(), "a");
    assertArrayEquals(new byte[] {1, 2, 3}, kept.database);
    assertEquals("7 tracker: ö", kept.refused.get(0).words());
    assertNull(KeptImages.of(folder.getRoot(), "b"));
  }

  @Test public void onlyTheLatestSetIsKept() {
    new KeptImages(new byte[1], refused).keep(folder.getRoot(), "a");
    new KeptImages(new byte[2], refused).keep(folder.getRoot(), "b");
    assertNull(KeptImages.of(folder.getRoot(), "a"));
    assertEquals(1, folder.getRoot().list().length);
  }

  @Test public void aDamagedOneIsNoneAtAll() throws Exception {
    new KeptImages(new byte[] {1, 2, 3}, refused).keep(folder.getRoot(), "a");
    File file = folder.getRoot().listFiles()[0];
    byte[] whole = Files.readAllBytes(file.toPath());
    for (int length = 0; length < whole.length; length++) {
      Files.write(file.toPath(), java.util.Arrays.copyOf(whole, length));
      assertNull(KeptImages.of(folder.getRoot(), "a"));
    }
    whole[4 + 2 + 1 + 2] = 'X'; // the reason's first letter
    Files.write(file.toPath(), whole);
    assertNull(KeptImages.of(folder.getRoot(), "a"));
  }
}
