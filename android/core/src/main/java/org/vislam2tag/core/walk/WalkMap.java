package org.vislam2tag.core.walk;

import java.util.ArrayList;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;
import java.util.stream.Collectors;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;

/**
 * The walk so far as the screen draws it: a line for each stretch that was tracked, the landmarks, the presses. The
 * number of points is bounded: when it is reached, every second one goes and points are taken half as often from then on.
 */
public final class WalkMap {
  /** More points than this a line of the screen does not need. */
  static final int MOST_POINTS = 2000;
  /** Points are taken at this distance at first, m. */
  static final double FIRST_SPACING_M = 0.25;

  /** A place on the floor in the tracker's frame, m: x to the right, y ahead (the tracker's -z); or on the floor's plan. */
  public static final class Point {
    public final float xM;
    public final float yM;

    Point(Pose pose) {
      this(pose.txM, -pose.tzM);
    }

    /** On a plan, m. */
    public Point(float xM, float yM) {
      this.xM = xM;
      this.yM = yM;
    }
  }

  private final List<List<Point>> lines = new ArrayList<>();
  private final Map<String, Point> landmarks = new LinkedHashMap<>();
  private final List<Point> presses = new ArrayList<>();
  private final List<Point> scans = new ArrayList<>();
  private double spacingM = FIRST_SPACING_M;
  private int points;
  private boolean broken = true;
  private Pose lastTaken;
  private Pose here;

  /** The camera was here, tracked. */
  public void at(Pose pose) {
    here = pose;
    if (broken) {
      lines.add(new ArrayList<>());
      broken = false;
    } else if (lastTaken.distanceM(pose) < spacingM) {
      return;
    }
    lines.get(lines.size() - 1).add(new Point(pose));
    lastTaken = pose;
    if (++points > MOST_POINTS) {
      thin();
    }
  }

  /** Tracking was lost: the line ends here. */
  public void broke() {
    broken = true;
  }

  /** A new part has a frame of its own, another floor a plan: what was drawn does not fit to it any more. */
  public void newPart() {
    lines.clear();
    landmarks.clear();
    presses.clear();
    scans.clear();
    points = 0;
    broken = true;
    here = null;
  }

  /** Landmarks stand where the tracker has them last. */
  public void landmarks(List<TrackedImage> images) {
    for (TrackedImage image : images) {
      boolean known = image.state == TrackingState.TRACKING && landmarks.containsKey(image.id);
      if (known || image.isSeenNow()) { // the tracker remembers those of another floor, too
        landmarks.put(image.id, new Point(image.pose));
      }
    }
  }

  /** The button was pressed here. */
  public void press() {
    presses.add(here == null ? null : new Point(here));
  }

  /** Wi-Fi was heard here. */
  public void scan() {
    if (here != null && scans.size() < MOST_POINTS) {
      scans.add(new Point(here));
    }
  }

  /** The latest press does not count. */
  public void undoPress() {
    if (!presses.isEmpty()) {
      presses.remove(presses.size() - 1);
    }
  }

  /** A copy for drawing, which the walk does not change any more. */
  public Drawing drawing() {
    List<List<Point>> copies = new ArrayList<>();
    for (List<Point> line : lines) {
      copies.add(new ArrayList<>(line));
    }
    List<Point> pressed = new ArrayList<>(presses);
    pressed.removeIf(point -> point == null);
    return new Drawing(copies, new LinkedHashMap<>(landmarks), pressed, new ArrayList<>(scans), here == null ? null : new Point(here));
  }

  private void thin() {
    spacingM *= 2;
    points = 0;
    broken |= lines.get(lines.size() - 1).size() == 1;
    lines.removeIf(line -> line.size() == 1);
    for (List<Point> line : lines) {
      List<Point> every = new ArrayList<>();
      for (int i = 0; i < line.size(); i += 2) {
        every.add(line.get(i));
      }
      line.clear();
      line.addAll(every);
      points += every.size();
    }
  }

  /** What is drawn; nothing in it changes. */
  public static final class Drawing {
    /** Stretches that were tracked. */
    public final List<List<Point>> lines;
    /** By id. */
    public final Map<String, Point> landmarks;
    public final List<Point> presses;
    /** Where Wi-Fi was heard. */
    public final List<Point> scans;
    /** Where the camera is; null before it was first tracked in this part. */
    public final Point here;

    Drawing(List<List<Point>> lines, Map<String, Point> landmarks, List<Point> presses, List<Point> scans, Point here) {
      this.lines = lines;
      this.landmarks = landmarks;
      this.presses = presses;
      this.scans = scans;
      this.here = here;
    }

    /** The same on a floor's plan. */
    public Drawing on(PlanFit fit) {
      Map<String, Point> marks = new LinkedHashMap<>();
      landmarks.forEach((id, point) -> marks.put(id, fit.place(point)));
      List<List<Point>> ways = new ArrayList<>();
      lines.forEach(line -> ways.add(placed(line, fit)));
      return new Drawing(ways, marks, placed(presses, fit), placed(scans, fit), here == null ? null : fit.place(here));
    }

    private static List<Point> placed(List<Point> points, PlanFit fit) {
      return points.stream().map(fit::place).collect(Collectors.toList());
    }
  }
}
