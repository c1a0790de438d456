package android.graphics;

import java.awt.Graphics2D;
import java.awt.RenderingHints;
import java.awt.Shape;
import java.awt.geom.AffineTransform;
import java.awt.image.BufferedImage;
import java.util.ArrayDeque;
import java.util.Deque;

/** Canvases that draw on AWT's pictures. */
public final class CanvasNatives {
  private static BufferedImage next;

  private CanvasNatives() {}

  /** A picture and what was saved of where and how it is drawn on. */
  static final class Drawn {
    final BufferedImage picture;
    final Graphics2D graphics;
    final Deque<Object[]> saved = new ArrayDeque<>();

    Drawn(BufferedImage picture) {
      this.picture = picture;
      graphics = picture.createGraphics();
      graphics.setRenderingHint(RenderingHints.KEY_ANTIALIASING, RenderingHints.VALUE_ANTIALIAS_ON);
      graphics.setRenderingHint(RenderingHints.KEY_TEXT_ANTIALIASING, RenderingHints.VALUE_TEXT_ANTIALIAS_ON);
      graphics.setRenderingHint(RenderingHints.KEY_FRACTIONALMETRICS, RenderingHints.VALUE_FRACTIONALMETRICS_ON);
      graphics.clipRect(0, 0, picture.getWidth(), picture.getHeight());
    }
  }

  /** A canvas on a picture. */
  public static synchronized Canvas on(BufferedImage picture) {
    next = picture;
    return new Canvas();
  }

  static Drawn of(long canvas) {
    return Handles.get(canvas);
  }

  static synchronized long nInitRaster(long bitmap) {
    return Handles.of(new Drawn(next == null ? new BufferedImage(1, 1, BufferedImage.TYPE_INT_RGB) : next));
  }

  static int nGetWidth(long canvas) {
    return of(canvas).picture.getWidth();
  }

  static int nGetHeight(long canvas) {
    return of(canvas).picture.getHeight();
  }

  static boolean nGetClipBounds(long canvas, Rect into) {
    java.awt.Rectangle clip = of(canvas).graphics.getClipBounds();
    into.set(clip.x, clip.y, clip.x + clip.width, clip.y + clip.height);
    return !clip.isEmpty();
  }

  static int nSave(long canvas, int flags) {
    Drawn drawn = of(canvas);
    drawn.saved.push(new Object[] {drawn.graphics.getTransform(), drawn.graphics.getClip()});
    return drawn.saved.size();
  }

  static int nSaveLayer(long canvas, float l, float t, float r, float b, long paint, int flags) {
    return nSave(canvas, flags);
  }

  static int nSaveLayerAlpha(long canvas, float l, float t, float r, float b, int alpha, int flags) {
    return nSave(canvas, flags);
  }

  static boolean nRestore(long canvas) {
    Drawn drawn = of(canvas);
    if (drawn.saved.isEmpty()) {
      return false;
    }
    Object[] state = drawn.saved.pop();
    drawn.graphics.setTransform((AffineTransform) state[0]);
    drawn.graphics.setClip((Shape) state[1]);
    return true;
  }

  static void nRestoreToCount(long canvas, int count) {
    while (of(canvas).saved.size() >= count && nRestore(canvas)) {
      continue;
    }
  }

  static int nGetSaveCount(long canvas) {
    return of(canvas).saved.size() + 1;
  }

  static void nTranslate(long canvas, float dx, float dy) {
    of(canvas).graphics.translate(dx, dy);
  }

  static void nScale(long canvas, float sx, float sy) {
    of(canvas).graphics.scale(sx, sy);
  }

  static void nRotate(long canvas, float degrees) {
    of(canvas).graphics.rotate(Math.toRadians(degrees));
  }

  static boolean nClipRect(long canvas, float left, float top, float right, float bottom, int operation) {
    of(canvas).graphics.clip(new java.awt.geom.Rectangle2D.Float(left, top, right - left, bottom - top));
    return !of(canvas).graphics.getClipBounds().isEmpty();
  }
}
