package org.vislam2tag.app.ar;

import android.graphics.Bitmap;
import android.graphics.BitmapFactory;
import com.google.ar.core.AugmentedImageDatabase;
import com.google.ar.core.Session;
import com.google.ar.core.exceptions.ImageInsufficientQualityException;
import java.io.ByteArrayInputStream;
import java.io.ByteArrayOutputStream;
import java.io.IOException;
import java.io.InputStream;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;
import org.vislam2tag.core.landmarks.GreyImage;
import org.vislam2tag.core.landmarks.ImageFolder;
import org.vislam2tag.core.landmarks.Landmark;
import org.vislam2tag.core.landmarks.LandmarkList;
import org.vislam2tag.core.landmarks.LandmarkLoader;
import org.vislam2tag.core.landmarks.Refusal;
import org.vislam2tag.core.landmarks.Refusal.Reason;

/** The landmarks of a folder as ARCore's database of images; what it refuses is told by name. */
public final class LandmarkImages {
  private final ImageFolder folder;
  private final LandmarkList list;
  private final List<Refusal> byTracker = new ArrayList<>();
  private byte[] made;

  private LandmarkImages(ImageFolder folder, LandmarkList list) {
    this.folder = folder;
    this.list = list;
  }

  /**
   * Loads and judges a folder. Takes seconds for hundreds of images: not for the main thread.
   *
   * @param widthM width of the prints where the folder has no manifest, m
   * @throws IOException if the folder or its manifest cannot be read
   */
  public static LandmarkImages load(ImageFolder folder, float widthM) throws IOException {
    return new LandmarkImages(folder, LandmarkLoader.load(folder, widthM, LandmarkImages::grey));
  }

  /** How many images are looked for. */
  public synchronized int count() {
    return list.landmarks.size() - byTracker.size();
  }

  /** All that are not looked for, and why. */
  public synchronized List<Refusal> refusals() {
    List<Refusal> all = new ArrayList<>(list.refusals);
    all.addAll(byTracker);
    return Collections.unmodifiableList(all);
  }

  /** Ids of those refused, as session.json lists them. */
  public String[] refusedIds() {
    return refusals().stream().map(refusal -> refusal.id).toArray(String[]::new);
  }

  /**
   * The database for one session; images that ARCore finds too plain become refusals. It takes long the first time, and is
   * kept for the sessions to come.
   */
  synchronized AugmentedImageDatabase database(Session session) {
    if (made != null) {
      return kept(session);
    }
    AugmentedImageDatabase images = new AugmentedImageDatabase(session);
    for (Landmark landmark : list.landmarks) {
      Refusal refusal = add(images, landmark);
      if (refusal != null) {
        byTracker.add(refusal);
      }
    }
    made = bytes(images);
    return images;
  }

  private static byte[] bytes(AugmentedImageDatabase images) {
    ByteArrayOutputStream bytes = new ByteArrayOutputStream();
    try {
      images.serialize(bytes);
    } catch (IOException e) {
      throw new IllegalStateException("memory takes bytes", e);
    }
    return bytes.toByteArray();
  }

  private AugmentedImageDatabase kept(Session session) {
    try {
      return AugmentedImageDatabase.deserialize(session, new ByteArrayInputStream(made));
    } catch (IOException e) {
      throw new IllegalStateException("ARCore does not read what it wrote", e);
    }
  }

  private Refusal add(AugmentedImageDatabase images, Landmark landmark) {
    try (InputStream in = folder.open(landmark.fileName)) {
      Bitmap bitmap = BitmapFactory.decodeStream(in);
      if (bitmap == null) {
        return new Refusal(landmark.id, Reason.UNREADABLE, landmark.fileName);
      }
      images.addImage(landmark.id, bitmap, landmark.widthM);
      return null;
    } catch (ImageInsufficientQualityException e) {
      return new Refusal(landmark.id, Reason.TRACKER, "");
    } catch (IOException e) {
      return new Refusal(landmark.id, Reason.UNREADABLE, landmark.fileName + ": " + e.getMessage());
    }
  }

  private static GreyImage grey(InputStream bytes) {
    Bitmap bitmap = BitmapFactory.decodeStream(bytes);
    if (bitmap == null) {
      return null;
    }
    int width = bitmap.getWidth();
    int height = bitmap.getHeight();
    int[] colours = new int[width * height];
    bitmap.getPixels(colours, 0, width, 0, 0, width, height);
    bitmap.recycle();
    return GreyImage.ofColours(width, height, colours);
  }
}
