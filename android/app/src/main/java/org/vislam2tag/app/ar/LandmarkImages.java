package org.vislam2tag.app.ar;

import android.graphics.Bitmap;
import android.graphics.BitmapFactory;
import com.google.ar.core.AugmentedImageDatabase;
import com.google.ar.core.Session;
import java.io.ByteArrayInputStream;
import java.io.ByteArrayOutputStream;
import java.io.File;
import java.io.IOException;
import java.io.InputStream;
import java.math.BigInteger;
import java.nio.charset.StandardCharsets;
import java.security.MessageDigest;
import java.security.NoSuchAlgorithmException;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;
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
  private final File cache;
  private final String key;
  private final List<Refusal> byTracker = new CopyOnWriteArrayList<>(); // the screen looks while the database is made
  private KeptImages made;

  /** Pixels of an image, about: more tell the tracker nothing. */
  private static final long MOST_PIXELS = 4_000_000;
  private static final int LEAST_SIDE = 600;
  private static final int MOST_BYTES = 64 << 20;

  private LandmarkImages(ImageFolder folder, LandmarkList list, File cache, String key) {
    this.folder = folder;
    this.list = list;
    this.cache = cache;
    this.key = key;
  }

  /**
   * Loads and judges a folder. Takes seconds for hundreds of images: not for the main thread.
   *
   * @param widthM width of the prints where the folder has no manifest, m
   * @param cache a folder where what ARCore makes of them is kept for the next time
   * @throws IOException if the folder or its manifest cannot be read
   */
  public static LandmarkImages load(ImageFolder folder, float widthM, File cache) throws IOException {
    MessageDigest digest = sha256();
    LandmarkList list = LandmarkLoader.load(folder, widthM, in -> {
      byte[] bytes = all(in);
      digest.update(bytes);
      return grey(bytes);
    });
    for (Landmark landmark : list.landmarks) {
      digest.update((landmark.id + "\n" + landmark.widthM + "\n").getBytes(StandardCharsets.UTF_8));
    }
    return new LandmarkImages(folder, list, cache, new BigInteger(1, digest.digest()).toString(16));
  }

  private static MessageDigest sha256() {
    try {
      return MessageDigest.getInstance("SHA-256");
    } catch (NoSuchAlgorithmException e) {
      throw new IllegalStateException("every Java has SHA-256", e);
    }
  }

  /** No landmarks at all. */
  public static LandmarkImages none() {
    return new LandmarkImages(null, LandmarkLoader.nothing(), null, "");
  }

  /** How many images are looked for. */
  public int count() {
    return list.landmarks.size() - byTracker.size();
  }

  /** All that are not looked for, and why. */
  public List<Refusal> refusals() {
    List<Refusal> all = new ArrayList<>(list.refusals);
    all.addAll(byTracker);
    return Collections.unmodifiableList(all);
  }

  /** Ids of those refused, as session.json lists them. */
  public String[] refusedIds() {
    return refusals().stream().map(refusal -> refusal.id).toArray(String[]::new);
  }

  /**
   * The database for one session; images that ARCore finds too plain become refusals. It takes minutes for a thousand the
   * first time, and is kept for the sessions to come, as long as the images are the same.
   */
  synchronized AugmentedImageDatabase database(Session session) {
    AugmentedImageDatabase kept = list.landmarks.isEmpty() ? null : kept(session);
    return kept == null ? made(session) : kept;
  }

  private AugmentedImageDatabase made(Session session) {
    byTracker.clear();
    AugmentedImageDatabase images = new AugmentedImageDatabase(session);
    for (Landmark landmark : list.landmarks) {
      Refusal refusal = add(images, landmark);
      if (refusal != null) {
        byTracker.add(refusal);
      }
    }
    made = new KeptImages(bytes(images), new ArrayList<>(byTracker));
    if (!list.landmarks.isEmpty()) {
      made.keep(cache, key);
    }
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

  /** The database made before; null where there is none, or it is of another version of ARCore that this one does not read. */
  private AugmentedImageDatabase kept(Session session) {
    KeptImages found = made == null ? KeptImages.of(cache, key) : made;
    if (found == null) {
      return null;
    }
    try {
      AugmentedImageDatabase images = AugmentedImageDatabase.deserialize(session, new ByteArrayInputStream(found.database));
      if (made == null) {
        byTracker.addAll(found.refused);
        made = found;
      }
      return images;
    } catch (IOException | RuntimeException e) {
      return null;
    }
  }

  private Refusal add(AugmentedImageDatabase images, Landmark landmark) {
    try (InputStream in = folder.open(landmark.fileName)) {
      Bitmap bitmap = bitmap(all(in));
      if (bitmap == null) {
        return new Refusal(landmark.id, Reason.UNREADABLE, landmark.fileName);
      }
      images.addImage(landmark.id, bitmap, landmark.widthM);
      bitmap.recycle();
      return null;
    } catch (IllegalArgumentException e) { // ImageInsufficientQualityException is one
      return new Refusal(landmark.id, Reason.TRACKER, "");
    } catch (IOException e) {
      return new Refusal(landmark.id, Reason.UNREADABLE, landmark.fileName + ": " + e.getMessage());
    }
  }

  /** An image of a size that a phone's memory takes, in the one kind of pixels that ARCore takes; null where it is none. */
  private static Bitmap bitmap(byte[] bytes) {
    BitmapFactory.Options options = new BitmapFactory.Options();
    options.inJustDecodeBounds = true;
    BitmapFactory.decodeByteArray(bytes, 0, bytes.length, options);
    options.inSampleSize = sample(options.outWidth, options.outHeight);
    options.inJustDecodeBounds = false;
    Bitmap bitmap = BitmapFactory.decodeByteArray(bytes, 0, bytes.length, options);
    boolean usual = bitmap == null || bitmap.getConfig() == Bitmap.Config.ARGB_8888; // with 16 bits a colour it is not
    return usual ? bitmap : bitmap.copy(Bitmap.Config.ARGB_8888, false);
  }

  /** Every how manyth pixel of a large image is taken. */
  static int sample(int width, int height) {
    int sample = 1;
    while ((long) width * height / ((long) sample * sample) > MOST_PIXELS
        && Math.min(width, height) / (2 * sample) >= LEAST_SIDE) {
      sample *= 2;
    }
    return sample;
  }

  private static byte[] all(InputStream in) throws IOException {
    ByteArrayOutputStream bytes = new ByteArrayOutputStream();
    byte[] buffer = new byte[1 << 16];
    for (int n = in.read(buffer); n >= 0; n = in.read(buffer)) {
      bytes.write(buffer, 0, n);
      if (bytes.size() > MOST_BYTES) {
        throw new IOException("larger than " + (MOST_BYTES >> 20) + " MB");
      }
    }
    return bytes.toByteArray();
  }

  private static GreyImage grey(byte[] bytes) {
    Bitmap bitmap = bitmap(bytes);
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
