package org.vislam2tag.core.record;

/** The sensors that are logged: the names are the table's words. */
public enum SensorKind {
  ACC(1, 3), ACC_UN(35, 6), GYRO(4, 3), GYRO_UN(16, 6), MAG(2, 3), MAG_UN(14, 6), ROT(11, 5), GAME_ROT(15, 4), PRESSURE(6, 1);

  /** Android's {@code Sensor.TYPE_} number. */
  public final int androidType;
  /** How many values a reading has. */
  public final int values;

  SensorKind(int androidType, int values) {
    this.androidType = androidType;
    this.values = values;
  }
}
