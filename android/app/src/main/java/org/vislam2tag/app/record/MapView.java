package org.vislam2tag.app.record;

import android.content.Context;
import android.graphics.Canvas;
import android.graphics.Color;
import android.graphics.Paint;
import android.graphics.RectF;
import android.util.AttributeSet;
import android.view.View;
import java.util.List;
import java.util.Map;
import org.vislam2tag.core.site.SiteFloor;
import org.vislam2tag.core.walk.PlanFit;
import org.vislam2tag.core.walk.WalkMap;

/** The walk so far with the landmarks: on the floor's plan once two landmarks tell how it lies there, else in the tracker's frame. */
public final class MapView extends View {
  private static final float DOT_DP = 3.5f;
  /** Who walks comes this far between two scans of a phone that is not slowed down: 3 s at a walking pace, m. */
  private static final float HEARD_M = 2;

  private final Paint way = paint(Color.rgb(0x4F, 0xC3, 0xF7));
  private final Paint landmark = paint(Color.rgb(0xFF, 0xB7, 0x4D));
  private final Paint press = paint(Color.rgb(0x81, 0xC7, 0x84));
  private final Paint here = paint(Color.WHITE);
  /** Where Wi-Fi was heard: what overlaps is darker. */
  private final Paint heard = paint(Color.argb(0x50, 0x4F, 0xC3, 0xF7));
  private final Paint picture = paint(Color.WHITE);
  private final float dot;
  private WalkMap.Drawing drawing;
  private FloorPlan under;

  /** As Android's layouts make it. */
  public MapView(Context context, AttributeSet attributes) {
    super(context, attributes);
    float density = getResources().getDisplayMetrics().density;
    dot = DOT_DP * density;
    way.setStyle(Paint.Style.STROKE);
    way.setStrokeWidth(dot / 2);
    landmark.setTextSize(4 * dot);
  }

  /** Shows another state of the walk, on this floor. */
  void show(WalkMap.Drawing walk, FloorPlan plan) {
    PlanFit fit = PlanFit.of(walk.landmarks, plan.floor.landmarks);
    drawing = fit == null ? walk : walk.on(fit);
    under = fit == null || plan.picture == null ? null : plan;
    invalidate();
  }

  @Override protected void onDraw(Canvas canvas) {
    if (drawing == null) {
      return;
    }
    MapFrame frame = new MapFrame(drawing, getWidth(), getHeight());
    if (under != null) {
      SiteFloor floor = under.floor;
      RectF place = new RectF(frame.x((float) floor.leftM), frame.y((float) floor.highM), frame.x((float) floor.rightM),
          frame.y((float) floor.lowM));
      canvas.drawBitmap(under.picture, null, place, picture);
    }
    for (WalkMap.Point point : drawing.scans) {
      canvas.drawCircle(frame.x(point), frame.y(point), HEARD_M * frame.scale(), heard);
    }
    for (List<WalkMap.Point> line : drawing.lines) {
      for (int i = 1; i < line.size(); i++) {
        canvas.drawLine(frame.x(line.get(i - 1)), frame.y(line.get(i - 1)), frame.x(line.get(i)), frame.y(line.get(i)), way);
      }
    }
    for (Map.Entry<String, WalkMap.Point> entry : drawing.landmarks.entrySet()) {
      dot(canvas, frame, entry.getValue(), landmark);
      canvas.drawText(entry.getKey(), frame.x(entry.getValue()) + 1.5f * dot, frame.y(entry.getValue()), landmark);
    }
    for (WalkMap.Point point : drawing.presses) {
      dot(canvas, frame, point, press);
    }
    if (drawing.here != null) {
      dot(canvas, frame, drawing.here, here);
    }
  }

  private void dot(Canvas canvas, MapFrame frame, WalkMap.Point point, Paint paint) {
    canvas.drawCircle(frame.x(point), frame.y(point), dot, paint);
  }

  private static Paint paint(int colour) {
    Paint paint = new Paint(Paint.ANTI_ALIAS_FLAG);
    paint.setColor(colour);
    return paint;
  }
}
