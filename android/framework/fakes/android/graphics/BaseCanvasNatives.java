package android.graphics;

import java.awt.BasicStroke;
import java.awt.Graphics2D;
import java.awt.Shape;
import java.awt.geom.Ellipse2D;
import java.awt.geom.Line2D;
import java.awt.geom.Rectangle2D;
import java.awt.geom.RoundRectangle2D;

/** Shapes and texts, as AWT draws them; bitmaps and paths are not drawn. */
final class BaseCanvasNatives {
  private BaseCanvasNatives() {}

  private static void draw(long canvas, Shape shape, long handle) {
    Graphics2D graphics = CanvasNatives.of(canvas).graphics;
    PaintState paint = Handles.get(handle);
    graphics.setColor(paint.ink());
    if (paint.style != Paint.Style.STROKE.nativeInt) {
      graphics.fill(shape);
    }
    if (paint.style != Paint.Style.FILL.nativeInt) {
      graphics.setStroke(new BasicStroke(Math.max(1, paint.strokeWidth)));
      graphics.draw(shape);
    }
  }

  static void nDrawColor(long canvas, int colour, int mode) {
    CanvasNatives.Drawn drawn = CanvasNatives.of(canvas);
    drawn.graphics.setColor(new java.awt.Color(colour, true));
    drawn.graphics.fill(drawn.graphics.getClip());
  }

  static void nDrawPaint(long canvas, long paint) {
    draw(canvas, CanvasNatives.of(canvas).graphics.getClip(), paint);
  }

  static void nDrawLine(long canvas, float x0, float y0, float x1, float y1, long paint) {
    Graphics2D graphics = CanvasNatives.of(canvas).graphics;
    graphics.setColor(Handles.<PaintState>get(paint).ink());
    graphics.setStroke(new BasicStroke(Math.max(1, Handles.<PaintState>get(paint).strokeWidth)));
    graphics.draw(new Line2D.Float(x0, y0, x1, y1));
  }

  static void nDrawRect(long canvas, float left, float top, float right, float bottom, long paint) {
    draw(canvas, new Rectangle2D.Float(left, top, right - left, bottom - top), paint);
  }

  static void nDrawOval(long canvas, float left, float top, float right, float bottom, long paint) {
    draw(canvas, new Ellipse2D.Float(left, top, right - left, bottom - top), paint);
  }

  static void nDrawCircle(long canvas, float x, float y, float radius, long paint) {
    draw(canvas, new Ellipse2D.Float(x - radius, y - radius, 2 * radius, 2 * radius), paint);
  }

  static void nDrawRoundRect(long canvas, float left, float top, float right, float bottom, float rx, float ry, long paint) {
    draw(canvas, new RoundRectangle2D.Float(left, top, right - left, bottom - top, 2 * rx, 2 * ry), paint);
  }

  static void nDrawText(long canvas, char[] text, int start, int count, float x, float y, int flags, long handle) {
    Graphics2D graphics = CanvasNatives.of(canvas).graphics;
    PaintState paint = Handles.get(handle);
    float width = paint.width(text, start, count);
    graphics.setColor(paint.ink());
    float at = paint.align == 1 ? x - width / 2 : paint.align == 2 ? x - width : x; // Paint.Align's CENTER and RIGHT
    for (int i = 0; i < count; i++) { // one by one: AWT knows no spacing of letters
      graphics.setFont(paint.font());
      graphics.drawString(String.valueOf(text[start + i]), at + paint.width(text, start, i), y);
    }
    if ((paint.flags & Paint.UNDERLINE_TEXT_FLAG) != 0) {
      graphics.fill(new Rectangle2D.Float(at, y + paint.textSize / 9, width, Math.max(1, paint.textSize / 18)));
    }
  }

  static void nDrawText(long canvas, String text, int start, int end, float x, float y, int flags, long paint) {
    nDrawText(canvas, text.toCharArray(), start, end - start, x, y, flags, paint);
  }

  static void nDrawTextRun(long canvas, String text, int start, int end, int contextStart, int contextEnd, float x, float y,
      boolean rtl, long paint) {
    nDrawText(canvas, text, start, end, x, y, 0, paint);
  }

  static void nDrawTextRun(long canvas, char[] text, int start, int count, int contextStart, int contextCount, float x, float y,
      boolean rtl, long paint, long measured) {
    nDrawText(canvas, text, start, count, x, y, 0, paint);
  }
}
