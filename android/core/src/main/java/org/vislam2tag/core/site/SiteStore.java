package org.vislam2tag.core.site;

import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.Map;
import org.vislam2tag.core.json.WholeFile;

/** The building that was taken from a computer last, kept on the phone with the plans of its floors. */
public final class SiteStore {
  private static final String TOLD = "site.json";

  private final File folder;

  /** In a folder of its own, which need not be there yet. */
  public SiteStore(File folder) {
    this.folder = folder;
  }

  /** The building; null where none was taken, or it cannot be read. */
  public Site site() {
    try {
      return Site.of(new String(Files.readAllBytes(new File(folder, TOLD).toPath()), StandardCharsets.UTF_8));
    } catch (IOException e) {
      return null;
    }
  }

  /** The picture of a floor's plan; null where there is none. */
  public File plan(SiteFloor floor) {
    File plan = new File(folder, name(floor.number));
    return floor.hasPlan && plan.isFile() ? plan : null;
  }

  /** Keeps a building in place of the one before; what it tells is written last. */
  public void keep(String told, Map<Integer, byte[]> plans) throws IOException {
    forget();
    Files.createDirectories(folder.toPath());
    for (Map.Entry<Integer, byte[]> plan : plans.entrySet()) {
      Files.write(new File(folder, name(plan.getKey())).toPath(), plan.getValue());
    }
    WholeFile.write(new File(folder, TOLD), told);
  }

  /** From here on there is none. */
  public void forget() throws IOException {
    Files.deleteIfExists(new File(folder, TOLD).toPath());
    File[] rest = folder.listFiles();
    for (File file : rest == null ? new File[0] : rest) {
      Files.delete(file.toPath());
    }
  }

  private static String name(int floor) {
    return "floor_" + floor + ".jpg";
  }
}
