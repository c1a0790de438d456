package org.vislam2tag.core.landmarks;

import java.io.IOException;
import java.io.InputStream;
import java.util.ArrayList;
import java.util.Collections;
import java.util.HashSet;
import java.util.List;
import java.util.Locale;
import java.util.Set;
import org.vislam2tag.core.landmarks.Refusal.Reason;

/**
 * Loads a folder of landmark images: one with a manifest, or any images of one width, whose ids are then their names
 * without ending. Images are decoded one at a time.
 */
public final class LandmarkLoader {
  /** The tracker takes no more images. */
  public static final int MOST = 1000;
  private static final String[] ENDINGS = {".png", ".jpg", ".jpeg", ".webp"};

  /** Decodes an image: Android's BitmapFactory in the app. */
  public interface Decoder {
    /** The image's brightness; null where the bytes are no image. */
    GreyImage decode(InputStream bytes) throws IOException;
  }

  private final ImageFolder folder;
  private final Decoder decoder;
  private final List<Landmark> good = new ArrayList<>();
  private final List<Refusal> refused = new ArrayList<>();
  private final Set<String> ids = new HashSet<>();

  private final int most;

  private LandmarkLoader(ImageFolder folder, Decoder decoder, int most) {
    this.folder = folder;
    this.decoder = decoder;
    this.most = most;
  }

  /**
   * Loads the folder; the list is empty where it holds no image.
   *
   * @param widthM width of the prints where there is no manifest, m
   * @throws IOException if the folder or its manifest cannot be read
   */
  public static LandmarkList load(ImageFolder folder, float widthM, Decoder decoder) throws IOException {
    return load(folder, widthM, decoder, MOST);
  }

  /** Of no folder. */
  public static LandmarkList nothing() {
    return new LandmarkList(Collections.emptyList(), Collections.emptyList());
  }

  static LandmarkList load(ImageFolder folder, float widthM, Decoder decoder, int most) throws IOException {
    LandmarkLoader loader = new LandmarkLoader(folder, decoder, most);
    List<String> names = new ArrayList<>(folder.fileNames());
    Collections.sort(names);
    for (Landmark landmark : names.contains(Manifest.FILE) ? loader.manifest() : images(names, widthM)) {
      Refusal refusal = loader.refusal(landmark, names);
      if (refusal == null) {
        loader.good.add(landmark);
      } else {
        loader.refused.add(refusal);
      }
    }
    return new LandmarkList(loader.good, loader.refused);
  }

  private List<Landmark> manifest() throws IOException {
    try (InputStream in = folder.open(Manifest.FILE)) {
      Manifest manifest = Manifest.read(in);
      refused.addAll(manifest.refusals());
      return manifest.landmarks();
    }
  }

  private static List<Landmark> images(List<String> names, float widthM) {
    List<Landmark> images = new ArrayList<>();
    for (String name : names) {
      int dot = name.lastIndexOf('.');
      if (dot > 0 && isImage(name)) {
        images.add(new Landmark(name.substring(0, dot), name, widthM));
      }
    }
    return images;
  }

  private static boolean isImage(String name) {
    for (String ending : ENDINGS) {
      if (name.toLowerCase(Locale.ROOT).endsWith(ending)) {
        return true;
      }
    }
    return false;
  }

  private Refusal refusal(Landmark landmark, List<String> names) {
    if (!ids.add(landmark.id)) {
      return new Refusal(landmark.id, Reason.DUPLICATE_ID, landmark.fileName);
    }
    if (!names.contains(landmark.fileName)) {
      return new Refusal(landmark.id, Reason.NO_FILE, landmark.fileName);
    }
    if (good.size() >= most) {
      return new Refusal(landmark.id, Reason.TOO_MANY, "at most " + most);
    }
    return looked(landmark);
  }

  private Refusal looked(Landmark landmark) {
    try (InputStream in = folder.open(landmark.fileName)) {
      GreyImage image = decoder.decode(in);
      if (image == null) {
        return new Refusal(landmark.id, Reason.UNREADABLE, landmark.fileName);
      }
      ImageQuality quality = ImageQuality.of(image);
      return quality.fault() == null ? null : new Refusal(landmark.id, quality.fault(), quality.words());
    } catch (IOException e) {
      return new Refusal(landmark.id, Reason.UNREADABLE, landmark.fileName + ": " + e.getMessage());
    }
  }
}
