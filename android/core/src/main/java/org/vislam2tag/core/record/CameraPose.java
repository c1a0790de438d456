package org.vislam2tag.core.record;

import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.FrameClock;
import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** One camera frame. */
public final class CameraPose implements Record {
  /** When the image was exposed, ns on the boot clock. */
  public final long timeNs;
  private final ClockReading arrival;
  private final long frameNs;
  private final FrameClock clock;
  private final int part;
  private final TrackingState state;
  private final String failure;
  private final Pose pose;

  /**
   * Dates a frame.
   *
   * @param arrival the clocks when the app got the frame
   * @param frameNs the stamp that the tracker gave it, ns on whatever clock
   * @param part number of the tracking session
   * @param failure ARCore's {@code TrackingFailureReason}
   */
  public CameraPose(ClockReading arrival, long frameNs, int part, TrackingState state, String failure, Pose pose) {
    this.arrival = arrival;
    this.frameNs = frameNs;
    this.clock = FrameClock.of(frameNs, arrival);
    this.timeNs = clock.exposedNs(frameNs, arrival);
    this.part = part;
    this.state = state;
    this.failure = failure;
    this.pose = pose;
  }

  /** The clock that the frame's stamp was found on. */
  public FrameClock clock() {
    return clock;
  }

  @Override public Table table() {
    return Table.CAMERA;
  }

  @Override public void write(Row row) {
    row.integer(timeNs).integer(arrival.bootNs).integer(frameNs).integer(arrival.nanoNs).text(clock.word);
    row.integer(part).text(state.name()).text(failure);
    pose.write(row);
  }
}
