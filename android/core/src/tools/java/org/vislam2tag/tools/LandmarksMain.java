package org.vislam2tag.tools;

import java.awt.image.BufferedImage;
import java.io.File;
import java.io.IOException;
import java.io.InputStream;
import javax.imageio.ImageIO;
import org.vislam2tag.core.landmarks.DiskFolder;
import org.vislam2tag.core.landmarks.GreyImage;
import org.vislam2tag.core.landmarks.Landmark;
import org.vislam2tag.core.landmarks.LandmarkList;
import org.vislam2tag.core.landmarks.LandmarkLoader;
import org.vislam2tag.core.landmarks.Refusal;

/** Loads a folder of landmark images as the app does: {@code LandmarksMain FOLDER}. */
public final class LandmarksMain {
  private static final float WIDTH_M = 0.2f;

  private LandmarksMain() {}

  /** Prints a line for each landmark, {@code id TAB file TAB width_m}, and those refused on standard error. */
  public static void main(String[] arguments) throws IOException {
    if (arguments.length != 1) {
      System.err.println("usage: LandmarksMain FOLDER");
      System.exit(2);
    }
    LandmarkList list = LandmarkLoader.load(new DiskFolder(new File(arguments[0])), WIDTH_M, LandmarksMain::decode);
    for (Landmark landmark : list.landmarks) {
      System.out.println(landmark.id + "\t" + landmark.fileName + "\t" + landmark.widthM);
    }
    for (Refusal refusal : list.refusals) {
      System.err.println(refusal.words());
    }
  }

  private static GreyImage decode(InputStream bytes) throws IOException {
    BufferedImage image = ImageIO.read(bytes);
    if (image == null) {
      return null;
    }
    int width = image.getWidth();
    int height = image.getHeight();
    return GreyImage.ofColours(width, height, image.getRGB(0, 0, width, height, null, 0, width));
  }
}
