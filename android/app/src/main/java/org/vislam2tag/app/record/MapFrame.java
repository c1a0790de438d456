package org.vislam2tag.app.record;

import java.util.List;
import org.vislam2tag.core.walk.WalkMap;

/** Where a place of the walk lies on a picture: all of it fits, one scale along both axes. */
final class MapFrame {
  private static final float LEAST_M = 5;
  private static final float MARGIN = 0.08f;

  private final float scale;
  private final float middleX;
  private final float middleY;
  private final float centreX;
  private final float centreY;

  /** For a picture of this size, pixels. */
  MapFrame(WalkMap.Drawing drawing, int width, int height) {
    float[] box = {Float.MAX_VALUE, Float.MAX_VALUE, -Float.MAX_VALUE, -Float.MAX_VALUE};
    for (List<WalkMap.Point> line : drawing.lines) {
      line.forEach(point -> grow(box, point));
    }
    drawing.landmarks.values().forEach(point -> grow(box, point));
    boolean empty = box[0] > box[2];
    middleX = empty ? 0 : (box[0] + box[2]) / 2;
    middleY = empty ? 0 : (box[1] + box[3]) / 2;
    float wide = empty ? LEAST_M : Math.max(LEAST_M, box[2] - box[0]);
    float high = empty ? LEAST_M : Math.max(LEAST_M, box[3] - box[1]);
    scale = (1 - 2 * MARGIN) * Math.min(width / wide, height / high);
    centreX = width / 2f;
    centreY = height / 2f;
  }

  /** Pixels of a metre. */
  float scale() {
    return scale;
  }

  float x(WalkMap.Point point) {
    return x(point.xM);
  }

  float x(float xM) {
    return centreX + scale * (xM - middleX);
  }

  /** Pixels grow downwards. */
  float y(WalkMap.Point point) {
    return y(point.yM);
  }

  float y(float yM) {
    return centreY - scale * (yM - middleY);
  }

  private static void grow(float[] box, WalkMap.Point point) {
    box[0] = Math.min(box[0], point.xM);
    box[1] = Math.min(box[1], point.yM);
    box[2] = Math.max(box[2], point.xM);
    box[3] = Math.max(box[3], point.yM);
  }
}
