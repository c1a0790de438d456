package org.vislam2tag.core.landmarks;

import java.io.IOException;
import java.io.InputStream;
import java.util.List;

/** A folder with images: on the phone's disk, or behind Android's document picker. */
public interface ImageFolder {
  /** Names of its files, without those of folders in it. */
  List<String> fileNames() throws IOException;

  /** A file's bytes; the caller closes them. */
  InputStream open(String fileName) throws IOException;
}
