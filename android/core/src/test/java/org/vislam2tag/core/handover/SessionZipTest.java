package org.vislam2tag.core.handover;

import static org.junit.Assert.assertArrayEquals;
import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.fail;

import java.io.ByteArrayOutputStream;
import java.io.File;
import java.io.IOException;
import java.io.InputStream;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import java.util.TimeZone;
import java.util.zip.ZipEntry;
import java.util.zip.ZipFile;
import org.junit.Before;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;

public class SessionZipTest {
  @Rule public final TemporaryFolder temporary = new TemporaryFolder();
  private File session;
  private File zip;

  @Before public void makeASession() throws IOException {
    session = temporary.newFolder("2021-12-20T132523");
    zip = new File(temporary.getRoot(), "s.zip");
    Files.write(new File(session, "session.json").toPath(), "{}".getBytes(StandardCharsets.UTF_8));
    Files.write(new File(session, "WiFi.csv").toPath(), "abc".getBytes(StandardCharsets.UTF_8));
    Files.write(new File(session, "Ble.csv").toPath(), new byte[0]);
    Files.write(new File(session, "session.json.tmp").toPath(), new byte[9]);
  }

  private static String text(InputStream in) throws IOException {
    ByteArrayOutputStream out = new ByteArrayOutputStream();
    for (int b = in.read(); b >= 0; b = in.read()) {
      out.write(b);
    }
    return new String(out.toByteArray(), StandardCharsets.UTF_8);
  }

  @Test public void theZipHoldsOneFolderInOrderWithChecksums() throws IOException {
    SessionZip.pack(session, zip, (bytes, ofBytes) -> {});
    List<String> names = new ArrayList<>();
    try (ZipFile read = new ZipFile(zip)) {
      for (ZipEntry entry : Collections.list(read.entries())) {
        names.add(entry.getName());
        assertEquals(null, entry.getExtra());
      }
      assertEquals("e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855  Ble.csv\n"
          + "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  WiFi.csv\n"
          + "44136fa355b3678a1146ad16f7e8649e94fb4fc21fe77e8310c060f61caaff8a  session.json\n",
          text(read.getInputStream(read.getEntry("2021-12-20T132523/SHA256SUMS"))));
      assertEquals("abc", text(read.getInputStream(read.getEntry("2021-12-20T132523/WiFi.csv"))));
    }
    assertEquals(Arrays.asList("2021-12-20T132523/Ble.csv", "2021-12-20T132523/SHA256SUMS", "2021-12-20T132523/WiFi.csv",
        "2021-12-20T132523/session.json"), names);
  }

  @Test public void theSameSessionGivesTheSameBytesWheneverItIsPacked() throws Exception {
    SessionZip.pack(session, zip, (bytes, ofBytes) -> {});
    byte[] first = Files.readAllBytes(zip.toPath());
    new File(session, "WiFi.csv").setLastModified(1_000_000_000_000L);
    Thread.sleep(5);
    SessionZip.pack(session, zip, (bytes, ofBytes) -> {});
    assertArrayEquals(first, Files.readAllBytes(zip.toPath()));
  }

  @Test public void aPackingThatIsStoppedLeavesNothing() throws IOException {
    try {
      SessionZip.pack(session, zip, (bytes, ofBytes) -> {
        throw new IOException("stopped at " + bytes + " of " + ofBytes);
      });
      fail("packed");
    } catch (IOException e) {
      assertEquals("stopped at 228 of 233", e.getMessage());
    }
    assertFalse(zip.exists());
    assertEquals(1, temporary.getRoot().list().length);
  }

  @Test public void whatIsNoSessionIsSaid() throws IOException {
    for (File none : new File[] {new File(temporary.getRoot(), "none"), temporary.newFolder("empty")}) {
      try {
        SessionZip.pack(none, zip, (bytes, ofBytes) -> {});
        fail("packed " + none);
      } catch (IOException e) {
        assertEquals("no session in " + none, e.getMessage());
      }
    }
  }

  @Test public void entriesAreOfTheFirstOfFebruary1980InEveryZone() throws IOException {
    SessionZip.pack(session, zip, (bytes, ofBytes) -> {});
    byte[] bytes = Files.readAllBytes(zip.toPath());
    assertEquals("MS-DOS time and date of the first entry, " + TimeZone.getDefault().getID(), "0 0 65 0",
        bytes[10] + " " + bytes[11] + " " + bytes[12] + " " + bytes[13]);
  }
}
