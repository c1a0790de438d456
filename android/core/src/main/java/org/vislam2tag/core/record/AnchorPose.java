package org.vislam2tag.core.record;

import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** Where an anchor is at one frame. */
public final class AnchorPose implements Record {
  private final long timeNs;
  private final int number;
  private final TrackingState state;
  private final Pose pose;

  /** At the frame that was exposed at {@code timeNs} on the boot clock. */
  public AnchorPose(long timeNs, int number, TrackingState state, Pose pose) {
    this.timeNs = timeNs;
    this.number = number;
    this.state = state;
    this.pose = pose;
  }

  @Override public Table table() {
    return Table.ANCHORS;
  }

  @Override public void write(Row row) {
    row.integer(timeNs).integer(number).text(state.name());
    pose.write(row);
  }
}
