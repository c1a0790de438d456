package android.graphics.drawable;

import android.content.res.Resources;
import android.graphics.Canvas;
import android.graphics.ColorFilter;
import android.graphics.Paint;
import android.graphics.PixelFormat;
import android.util.AttributeSet;
import org.xmlpull.v1.XmlPullParser;

/** A line at the bottom: of all nine-patches the app shows but the underline of its fields. */
public class NinePatchDrawable extends Drawable {
  private final Paint paint = new Paint();

  public NinePatchDrawable() {
    paint.setColor(0xFFB0B0B0);
  }

  @Override public void inflate(Resources resources, XmlPullParser parser, AttributeSet attributes, Resources.Theme theme) {}

  @Override public void draw(Canvas canvas) {
    canvas.drawRect(getBounds().left, getBounds().bottom - 2, getBounds().right, getBounds().bottom, paint);
  }

  @Override public void setAlpha(int alpha) {}

  @Override public void setColorFilter(ColorFilter filter) {}

  @Override public int getOpacity() {
    return PixelFormat.TRANSLUCENT;
  }
}
