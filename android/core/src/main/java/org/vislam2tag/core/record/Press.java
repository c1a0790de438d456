package org.vislam2tag.core.record;

import org.vislam2tag.core.table.Record;
import org.vislam2tag.core.table.Row;
import org.vislam2tag.core.table.Table;

/** A press of the control-point button or a tap on the plan, or that it was taken back. */
public final class Press implements Record {
  private final long timeNs;
  private final int number;
  private final String action;
  /** Of a tap; NaN else. */
  public final float xM;
  public final float yM;
  private final float sigmaM;

  private Press(long timeNs, int number, String action, float xM, float yM, float sigmaM) {
    this.timeNs = timeNs;
    this.number = number;
    this.action = action;
    this.xM = xM;
    this.yM = yM;
    this.sigmaM = sigmaM;
  }

  /** The button, at {@code timeNs} on the boot clock; presses and taps are counted from 0. */
  public static Press button(long timeNs, int number) {
    return new Press(timeNs, number, "press", Float.NaN, Float.NaN, Float.NaN);
  }

  /** The walker is there: metres in the frame of the floor's plan, with the sigma of each. */
  public static Press tap(long timeNs, int number, float xM, float yM, float sigmaM) {
    return new Press(timeNs, number, "tap", xM, yM, sigmaM);
  }

  /** That this press or tap does not count. */
  public Press undone(long whenNs) {
    return new Press(whenNs, number, "undo", Float.NaN, Float.NaN, Float.NaN);
  }

  /** Is it one on the plan? */
  public boolean isTap() {
    return !Float.isNaN(xM);
  }

  @Override public Table table() {
    return Table.PRESSES;
  }

  @Override public void write(Row row) {
    row.integer(timeNs).integer(number).text(action).number(xM).number(yM).number(sigmaM);
  }
}
