package org.vislam2tag.core.radio;

/** What a phone hears with. */
public enum Radio {
  WIFI("wifi"), BLE("ble");

  /** In the details of events. */
  public final String word;

  Radio(String word) {
    this.word = word;
  }
}
