package org.vislam2tag.app.record;

import android.content.Context;
import android.graphics.Bitmap;
import android.graphics.Canvas;
import android.graphics.Color;
import android.graphics.Paint;
import android.graphics.RectF;
import android.view.GestureDetector;
import android.view.MotionEvent;
import android.view.ScaleGestureDetector;
import android.view.View;
import java.util.Collections;
import java.util.List;
import org.vislam2tag.app.R;
import org.vislam2tag.core.record.Press;
import org.vislam2tag.core.site.SiteFloor;
import org.vislam2tag.core.walk.PlanFrame;

/** A floor's plan, or a grid of metres, that the collector taps where they stand; one finger moves it, two enlarge it. */
public final class PlanView extends View {
  /** Is told of taps. */
  public interface Listener {
    /** There, in metres of the floor's frame, with the sigma of each axis. */
    void tapped(float xM, float yM, float sigmaM);
  }

  private static final int GRID_M = 5;
  private static final float DOT_DP = 6;

  private final SiteFloor floor;
  private final Bitmap plan;
  private final Listener listener;
  private final float density;
  private final Paint line = paint(Color.rgb(0x60, 0x60, 0x60));
  private final Paint mark = paint(Color.rgb(0xD5, 0x00, 0x00));
  private final GestureDetector fingers;
  private final ScaleGestureDetector two;
  private List<Press> taps = Collections.emptyList();
  private PlanFrame frame;

  /** {@code plan} fills the floor's extent; null: a grid. */
  public PlanView(Context context, SiteFloor floor, Bitmap plan, Listener listener) {
    super(context);
    this.floor = floor;
    this.plan = plan;
    this.listener = listener;
    density = getResources().getDisplayMetrics().density;
    mark.setTextSize(3 * DOT_DP * density);
    setBackgroundColor(Color.WHITE);
    setContentDescription(context.getString(R.string.plan_description));
    fingers = new GestureDetector(context, new One());
    two = new ScaleGestureDetector(context, new Two());
  }

  /** Shows the taps that count. */
  public void show(List<Press> counting) {
    taps = counting;
    invalidate();
  }

  @Override protected void onSizeChanged(int width, int height, int oldWidth, int oldHeight) {
    frame = new PlanFrame(floor.leftM, floor.lowM, floor.rightM, floor.highM, width, height, density);
  }

  @Override public boolean onTouchEvent(MotionEvent event) {
    two.onTouchEvent(event);
    fingers.onTouchEvent(event);
    return true;
  }

  @Override protected void onDraw(Canvas canvas) {
    if (frame == null) {
      return;
    }
    if (plan == null) {
      grid(canvas);
    } else {
      RectF place = new RectF(frame.x(floor.leftM), frame.y(floor.highM), frame.x(floor.rightM), frame.y(floor.lowM));
      canvas.drawBitmap(plan, null, place, line);
    }
    for (int i = 0; i < taps.size(); i++) {
      float x = frame.x(taps.get(i).xM);
      float y = frame.y(taps.get(i).yM);
      canvas.drawCircle(x, y, DOT_DP * density, mark);
      canvas.drawText(Integer.toString(i + 1), x + 1.5f * DOT_DP * density, y, mark);
    }
  }

  private void grid(Canvas canvas) {
    for (double xM = GRID_M * Math.ceil(floor.leftM / GRID_M); xM <= floor.rightM; xM += GRID_M) {
      canvas.drawLine(frame.x(xM), frame.y(floor.lowM), frame.x(xM), frame.y(floor.highM), line);
    }
    for (double yM = GRID_M * Math.ceil(floor.lowM / GRID_M); yM <= floor.highM; yM += GRID_M) {
      canvas.drawLine(frame.x(floor.leftM), frame.y(yM), frame.x(floor.rightM), frame.y(yM), line);
    }
  }

  /** A tap at this place of the screen. */
  void tapped(float x, float y) {
    if (frame != null) {
      listener.tapped((float) frame.xM(x), (float) frame.yM(y), (float) frame.sigmaM());
    }
  }

  private static Paint paint(int colour) {
    Paint paint = new Paint(Paint.ANTI_ALIAS_FLAG | Paint.FILTER_BITMAP_FLAG);
    paint.setColor(colour);
    return paint;
  }

  private final class One extends GestureDetector.SimpleOnGestureListener {
    @Override public boolean onSingleTapUp(MotionEvent event) {
      tapped(event.getX(), event.getY());
      return true;
    }

    @Override public boolean onScroll(MotionEvent from, MotionEvent to, float left, float up) {
      frame.move(-left, -up);
      invalidate();
      return true;
    }
  }

  private final class Two extends ScaleGestureDetector.SimpleOnScaleGestureListener {
    @Override public boolean onScale(ScaleGestureDetector fingersNow) {
      frame.enlarge(fingersNow.getScaleFactor(), fingersNow.getFocusX(), fingersNow.getFocusY());
      invalidate();
      return true;
    }
  }
}
