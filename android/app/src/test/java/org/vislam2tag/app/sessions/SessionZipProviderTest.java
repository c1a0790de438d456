package org.vislam2tag.app.sessions;

import static org.junit.Assert.assertArrayEquals;

import android.provider.OpenableColumns;
import java.io.File;
import java.nio.file.Files;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;

public class SessionZipProviderTest {
  @Rule public final TemporaryFolder folder = new TemporaryFolder();

  @Test public void whatIsAskedForComesInTheOrderAskedFor() throws Exception {
    File zip = new File(folder.getRoot(), "a.zip");
    Files.write(zip.toPath(), new byte[7]);
    String[] columns = {OpenableColumns.SIZE, "mime_type", OpenableColumns.DISPLAY_NAME};
    assertArrayEquals(new Object[] {7L, null, "a.zip"}, SessionZipProvider.row(zip, columns));
  }
}
