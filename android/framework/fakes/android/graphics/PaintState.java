package android.graphics;

import java.awt.Font;
import java.awt.FontFormatException;
import java.awt.font.FontRenderContext;
import java.io.File;
import java.io.IOException;
import java.util.HashMap;
import java.util.Map;

/** What a paint knows, and how wide AWT finds a text with it: Roboto, as Android's, without hinting. */
public final class PaintState implements Cloneable {
  static final FontRenderContext UNHINTED = new FontRenderContext(null, true, true);
  private static final String FONTS = "/usr/share/fonts/truetype/roboto/unhinted/RobotoTTF/Roboto-";
  private static final Map<String, Font> LOADED = new HashMap<>();
  // of the font's hhea and head tables, in parts of its size
  private static final float ASCENT = 1900 / 2048f;
  private static final float DESCENT = 500 / 2048f;
  private static final float TOP = 2163 / 2048f;
  private static final float BOTTOM = 555 / 2048f;

  int colour = 0xFF000000;
  int style;
  int flags;
  int align;
  float textSize = 12;
  float strokeWidth;
  float letterSpacing;
  long typeface = 400;
  int[] filter;

  @Override public PaintState clone() {
    try {
      return (PaintState) super.clone();
    } catch (CloneNotSupportedException e) {
      throw new AssertionError(e);
    }
  }

  Font font() {
    long weight = Math.abs(typeface);
    String name = (weight >= 600 ? "Bold" : weight >= 500 ? "Medium" : "Regular") + ".ttf";
    Font font;
    synchronized (LOADED) {
      font = LOADED.computeIfAbsent(name, PaintState::load);
    }
    return font.deriveFont(textSize);
  }

  private static Font load(String name) {
    try {
      return Font.createFont(Font.TRUETYPE_FONT, new File(FONTS + name));
    } catch (FontFormatException | IOException e) {
      throw new IllegalStateException("no " + FONTS + name + ": install fonts-roboto-unhinted", e);
    }
  }

  /** The width of each char, pixels. */
  public float[] widths(char[] text, int start, int count) {
    float[] widths = new float[count];
    if (count > 0) {
      java.awt.font.GlyphVector glyphs = font().createGlyphVector(UNHINTED, new String(text, start, count));
      for (int i = 0; i < count && i < glyphs.getNumGlyphs(); i++) {
        widths[i] = text[start + i] == '\n' ? 0 : glyphs.getGlyphMetrics(i).getAdvanceX() + letterSpacing * textSize;
      }
    }
    return widths;
  }

  float width(char[] text, int start, int count) {
    float sum = 0;
    for (float width : widths(text, start, count)) {
      sum += width;
    }
    return sum;
  }

  float metrics(Paint.FontMetrics into) {
    if (into != null) {
      into.ascent = -ASCENT * textSize;
      into.descent = DESCENT * textSize;
      into.top = -TOP * textSize;
      into.bottom = BOTTOM * textSize;
    }
    return (ASCENT + DESCENT) * textSize;
  }

  /** The colour that is drawn, with the tint of a filter. */
  java.awt.Color ink() {
    if (filter == null) {
      return new java.awt.Color(colour, true);
    }
    int alpha = (colour >>> 24) * (filter[0] >>> 24) / 255;
    return new java.awt.Color(filter[0] & 0xFFFFFF | alpha << 24, true);
  }
}
