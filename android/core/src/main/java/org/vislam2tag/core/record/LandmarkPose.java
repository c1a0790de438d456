package org.vislam2tag.core.record;

import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** What the tracker says of a landmark at one frame. */
public final class LandmarkPose implements Record {
  private final long timeNs;
  private final TrackedImage image;

  /** At the frame that was exposed at {@code timeNs} on the boot clock. */
  public LandmarkPose(long timeNs, TrackedImage image) {
    this.timeNs = timeNs;
    this.image = image;
  }

  @Override public Table table() {
    return Table.LANDMARKS;
  }

  @Override public void write(Row row) {
    row.integer(timeNs).text(image.id).text(image.state.name()).text(image.method);
    image.pose.write(row);
    extent(row, image.extentXM);
    extent(row, image.extentZM);
  }

  private static void extent(Row row, float metres) {
    row.number(metres == 0 ? Float.NaN : metres);
  }
}
