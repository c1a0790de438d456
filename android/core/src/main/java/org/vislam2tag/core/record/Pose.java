package org.vislam2tag.core.record;

import org.vislam2tag.core.table.Row;

/** Position (m) and orientation (unit quaternion) in the tracker's frame: right-handed, y up. */
public final class Pose {
  public final float txM;
  public final float tyM;
  public final float tzM;
  public final float qx;
  public final float qy;
  public final float qz;
  public final float qw;

  public Pose(float txM, float tyM, float tzM, float qx, float qy, float qz, float qw) {
    this.txM = txM;
    this.tyM = tyM;
    this.tzM = tzM;
    this.qx = qx;
    this.qy = qy;
    this.qz = qz;
    this.qw = qw;
  }

  /** Distance of the two positions in space, m. */
  public double distanceM(Pose other) {
    double x = (double) txM - other.txM;
    double y = (double) tyM - other.tyM;
    double z = (double) tzM - other.tzM;
    return Math.sqrt(x * x + y * y + z * z);
  }

  /** Angle of the rotation between the two orientations, rad, 0 to pi. */
  public double angleRad(Pose other) {
    double dot = Math.abs((double) qx * other.qx + (double) qy * other.qy + (double) qz * other.qz + (double) qw * other.qw);
    return 2 * Math.acos(Math.min(1, dot));
  }

  void write(Row row) {
    row.number(txM).number(tyM).number(tzM).number(qx).number(qy).number(qz).number(qw);
  }
}
