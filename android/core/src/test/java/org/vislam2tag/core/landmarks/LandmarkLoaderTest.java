package org.vislam2tag.core.landmarks;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;
import static org.junit.Assert.fail;

import java.io.ByteArrayInputStream;
import java.io.File;
import java.io.IOException;
import java.io.InputStream;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.List;
import java.util.Locale;
import java.util.Map;
import java.util.TreeMap;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.landmarks.Refusal.Reason;

public class LandmarkLoaderTest {
  @Rule public final TemporaryFolder temporary = new TemporaryFolder();
  private final Map<String, String> files = new TreeMap<>();
  private final ImageFolder folder = new ImageFolder() {
    @Override public List<String> fileNames() {
      return new ArrayList<>(files.keySet());
    }

    @Override public InputStream open(String fileName) {
      return new ByteArrayInputStream(files.get(fileName).getBytes(StandardCharsets.UTF_8));
    }
  };
  /** A file of this test says what image it is. */
  private final LandmarkLoader.Decoder decoder = bytes -> {
    switch ((char) bytes.read()) {
      case 'g':
        return TestImages.leaves(320, 400, 1);
      case 'p':
        return TestImages.flat(400, 400);
      case 's':
        return TestImages.leaves(299, 400, 1);
      case 'e':
        throw new IOException("broken off");
      default:
        return null;
    }
  };

  private LandmarkList load() throws IOException {
    return LandmarkLoader.load(folder, 0.2f, decoder);
  }

  private static String words(LandmarkList list) {
    StringBuilder text = new StringBuilder();
    for (Landmark landmark : list.landmarks) {
      text.append(landmark.id).append('=').append(landmark.fileName).append('@').append(landmark.widthM).append(' ');
    }
    for (Refusal refusal : list.refusals) {
      text.append(refusal.id).append(':').append(refusal.reason).append(' ');
    }
    return text.toString().trim();
  }

  @Test public void aManifestNamesTheImagesAndTheirWidths() throws IOException {
    files.put("manifest.csv", "\uFEFFwidth_m,id,more,file\r\n0.2,12,,a.png\r\n0.15,\"7, \"\"left\"\"\",x,b.jpg\r\n\r\n");
    files.put("a.png", "g");
    files.put("b.jpg", "g");
    files.put("not-named.png", "g");
    assertEquals("12=a.png@0.2 7, \"left\"=b.jpg@0.15", words(load()));
  }

  @Test public void whatIsWrongIsRefusedByName() throws IOException {
    files.put("manifest.csv", "id,file,width_m\n1,a.png,0.2\n1,b.png,0.2\n2,none.png,0.2\n3,../a.png,0.2\n3a,sub/a.png,0.2\n3b,sub\\a.png,0.2\n4,a.png,\"0,2\"\n"
        + "5,a.png,-1\n6,a.png,20\n7,a.png,NaN\n,a.png,0.2\n8,plain.png,0.2\n9,small.png,0.2\n10,text.png,0.2\n11,half.png,0.2\n12\n");
    files.put("a.png", "g");
    files.put("b.png", "g");
    files.put("plain.png", "p");
    files.put("small.png", "s");
    files.put("text.png", "t");
    files.put("half.png", "e");
    assertEquals("1=a.png@0.2 3:BAD_LINE 3a:BAD_LINE 3b:BAD_LINE 4:BAD_LINE 5:BAD_LINE 6:BAD_LINE 7:BAD_LINE row 11:BAD_LINE 12:BAD_LINE "
        + "1:DUPLICATE_ID 2:NO_FILE 8:TOO_PLAIN 9:TOO_SMALL 10:UNREADABLE 11:UNREADABLE", words(load()));
  }

  @Test public void refusalsReadWellInTheLog() throws IOException {
    files.put("plain.png", "p");
    assertEquals("plain too_plain: 400 x 400 pixels, contrast 0, 0 corners in 0 of 64 places", load().refusals.get(0).words());
    assertEquals("7 tracker", new Refusal("7", Reason.TRACKER, "").words());
  }

  @Test public void withoutAManifestImagesAreNamedByTheirFiles() throws IOException {
    files.put("12.png", "g");
    files.put("hall.east.JPG", "g");
    files.put("readme.txt", "g");
    files.put(".png", "g");
    assertEquals("12=12.png@0.2 hall.east=hall.east.JPG@0.2", words(load()));
  }

  @Test public void anEmptyFolderHasNoLandmarks() throws IOException {
    assertEquals("", words(load()));
    files.put("manifest.csv", "id,file,width_m\n");
    assertEquals("", words(load()));
  }

  @Test public void aManifestWithoutAColumnIsAnError() throws IOException {
    for (String text : new String[] {"", "id,file\n1,a.png\n", "\n\n"}) {
      files.put("manifest.csv", text);
      try {
        load();
        fail(text);
      } catch (IOException e) {
        assertTrue(e.getMessage(), e.getMessage().startsWith("manifest.csv has no column"));
      }
    }
  }

  @Test public void theTrackerTakesSoManyImagesAndTheRestIsNamed() throws IOException {
    for (String id : new String[] {"1", "2", "3", "4", "5"}) {
      files.put(id + ".png", id.equals("2") ? "p" : "g");
    }
    assertEquals("1=1.png@0.2 3=3.png@0.2 2:TOO_PLAIN 4:TOO_MANY 5:TOO_MANY",
        words(LandmarkLoader.load(folder, 0.2f, decoder, 2)));
    assertEquals(1000, LandmarkLoader.MOST);
  }

  @Test public void aFolderOnTheDiskIsReadToo() throws IOException {
    File disk = temporary.getRoot();
    Files.write(new File(disk, "1.png").toPath(), new byte[] {'g'});
    temporary.newFolder("2.png");
    assertEquals("1=1.png@0.2", words(LandmarkLoader.load(new DiskFolder(disk), 0.2f, decoder)));
    try {
      LandmarkLoader.load(new DiskFolder(new File(disk, "none")), 0.2f, decoder);
      fail("read");
    } catch (IOException e) {
      assertTrue(e.getMessage(), e.getMessage().contains("none"));
    }
  }

  @Test public void widthsHaveAPointInEveryLocale() throws IOException {
    Locale usual = Locale.getDefault();
    Locale.setDefault(Locale.GERMANY);
    try {
      aManifestNamesTheImagesAndTheirWidths();
    } finally {
      Locale.setDefault(usual);
    }
  }
}
