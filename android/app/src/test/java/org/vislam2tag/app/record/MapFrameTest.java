package org.vislam2tag.app.record;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;

import org.junit.Test;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.walk.WalkMap;

public class MapFrameTest {
  @Test public void allOfTheWalkFitsWithOneScale() {
    WalkMap map = new WalkMap();
    for (int i = 0; i <= 40; i++) {
      map.at(new Pose(i, 0, -0.5f * i, 0, 0, 0, 1));
    }
    WalkMap.Drawing drawing = map.drawing();
    MapFrame frame = new MapFrame(drawing, 400, 300);
    WalkMap.Point first = drawing.lines.get(0).get(0);
    WalkMap.Point last = drawing.here;
    assertTrue(frame.x(first) > 0 && frame.x(last) < 400);
    assertEquals(2 * (frame.y(first) - frame.y(last)), frame.x(last) - frame.x(first), 1e-3);
    assertTrue("ahead is up", frame.y(last) < frame.y(first));
  }

  @Test public void aWalkWithoutPointsHasAMiddle() {
    MapFrame frame = new MapFrame(new WalkMap().drawing(), 400, 300);
    WalkMap map = new WalkMap();
    map.at(new Pose(0, 0, 0, 0, 0, 0, 1));
    assertEquals(200, frame.x(map.drawing().here), 1e-3);
    assertEquals(150, frame.y(map.drawing().here), 1e-3);
  }
}
