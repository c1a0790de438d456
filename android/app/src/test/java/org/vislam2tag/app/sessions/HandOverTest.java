package org.vislam2tag.app.sessions;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;

import java.io.File;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;

public class HandOverTest {
  private static final long PACKED_MS = 1_640_003_000_000L;

  @Rule public final TemporaryFolder folder = new TemporaryFolder();

  @Test public void aSessionThatChangedIsPackedAgain() throws Exception {
    assertTrue(isCurrent(-60_000));
    assertEquals(false, isCurrent(60_000));
  }

  @Test public void aSessionThatWasNeverPackedIsPacked() throws Exception {
    File session = folder.newFolder();
    assertTrue(new File(session, "session.json").createNewFile());
    assertEquals(false, HandOver.isCurrent(new File(folder.getRoot(), "none.zip"), session));
  }

  private boolean isCurrent(long changedMs) throws Exception {
    File session = folder.newFolder();
    File record = new File(session, "session.json");
    File zip = folder.newFile();
    assertTrue(record.createNewFile() && zip.setLastModified(PACKED_MS) && record.setLastModified(PACKED_MS + changedMs));
    return HandOver.isCurrent(zip, session);
  }
}
