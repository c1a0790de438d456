package android.graphics;

import android.content.res.AssetManager;
import android.content.res.FontResourcesParser;
import android.graphics.fonts.FontVariationAxis;

/** A weight and a slant of Roboto, the one family of this phone; the pixels are AWT's. */
public class Typeface {
  public static final int NORMAL = 0;
  public static final int BOLD = 1;
  public static final int ITALIC = 2;
  public static final int BOLD_ITALIC = 3;
  public static final int RESOLVE_BY_FONT_TABLE = -1;
  public static final String DEFAULT_FAMILY = "sans-serif";
  public static final Typeface DEFAULT = new Typeface(400, false);
  public static final Typeface DEFAULT_BOLD = new Typeface(700, false);
  public static final Typeface SANS_SERIF = DEFAULT;
  public static final Typeface SERIF = DEFAULT;
  public static final Typeface MONOSPACE = DEFAULT;
  private static final int BOLD_WEIGHT = 600;

  public @interface Style {}

  /** Weight, negative where it is slanted. */
  public final long native_instance;

  private Typeface(int weight, boolean italic) {
    native_instance = italic ? -weight : weight;
  }

  public static Typeface create(String family, int style) {
    return create("sans-serif-medium".equals(family) ? new Typeface(500, false) : DEFAULT, style);
  }

  public static Typeface create(Typeface from, int style) {
    int weight = from == null ? 400 : from.getWeight();
    return new Typeface((style & BOLD) == 0 ? weight : Math.max(weight, 700), (style & ITALIC) != 0);
  }

  public static Typeface create(Typeface from, int weight, boolean italic) {
    return new Typeface(weight, italic);
  }

  public static Typeface createFromTypefaceWithVariation(Typeface from, java.util.List<FontVariationAxis> axes) {
    return from;
  }

  public static Typeface createFromResources(FontResourcesParser.FamilyResourceEntry entry, AssetManager assets, String path) {
    return DEFAULT;
  }

  public static Typeface findFromCache(AssetManager assets, String path) {
    return null;
  }

  public static Typeface defaultFromStyle(int style) {
    return create(DEFAULT, style);
  }

  public int getWeight() {
    return (int) Math.abs(native_instance);
  }

  public int getStyle() {
    return (isBold() ? BOLD : 0) | (isItalic() ? ITALIC : 0);
  }

  public final boolean isBold() {
    return getWeight() >= BOLD_WEIGHT;
  }

  public final boolean isItalic() {
    return native_instance < 0;
  }

  public boolean isSupportedAxes(int axis) {
    return false;
  }
}
