package org.vislam2tag.core.landmarks;

/** An image to look for. */
public final class Landmark {
  public final String id;
  public final String fileName;
  /** Width of the print, m. */
  public final float widthM;

  Landmark(String id, String fileName, float widthM) {
    this.id = id;
    this.fileName = fileName;
    this.widthM = widthM;
  }
}
