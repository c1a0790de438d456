package org.vislam2tag.core.landmarks;

import java.io.File;
import java.io.FileInputStream;
import java.io.IOException;
import java.io.InputStream;
import java.util.ArrayList;
import java.util.List;

/** A folder on the disk. */
public final class DiskFolder implements ImageFolder {
  private final File folder;

  public DiskFolder(File folder) {
    this.folder = folder;
  }

  @Override public List<String> fileNames() throws IOException {
    File[] files = folder.listFiles(File::isFile);
    if (files == null) {
      throw new IOException("cannot read the folder " + folder);
    }
    List<String> names = new ArrayList<>();
    for (File file : files) {
      names.add(file.getName());
    }
    return names;
  }

  @Override public InputStream open(String fileName) throws IOException {
    return new FileInputStream(new File(folder, fileName));
  }
}
