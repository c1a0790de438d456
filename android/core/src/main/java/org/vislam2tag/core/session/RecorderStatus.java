package org.vislam2tag.core.session;

import java.util.Map;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.radio.ScanLog;
import org.vislam2tag.core.walk.WalkStatus;

/** What the screen shows of a recording; a copy that does not change. */
public final class RecorderStatus {
  /** Since the start, s. */
  public final double elapsedS;
  public final WalkStatus walk;
  /** Tracking sessions so far, less one. */
  public final int part;
  /** Deliveries of Wi-Fi results. */
  public final int scans;
  /** Scans refused when asked for. */
  public final int scansRefused;
  /** Deliveries of older readings only, as the scan failed. */
  public final int scansFailed;
  /** Wi-Fi readings that were new. */
  public final long wifiReadings;
  /** Are scans throttled: {@code on}, {@code off}; null where the platform does not tell. */
  public final String throttling;
  public final long bleReadings;
  /** For how long nothing was heard with the screen off, s. */
  public final Map<Radio, Double> silentS;
  /** Presses of the control-point button that count. */
  public final int presses;
  /** By how much the wall clock jumped last, ms, with sign; 0 where it never did. */
  public final long clockJumpMs;
  /** Where the collector said to be: chosen before the start, or since. */
  public final int floor;
  /** Does the magnetometer want to be calibrated? */
  public final boolean magnetometerLow;
  /** Null while recording. */
  public final SessionEnd end;

  RecorderStatus(double elapsedS, WalkStatus walk, int part, ScanLog scans, Map<Radio, Double> silentS, long bleReadings,
      int presses, long clockJumpMs, int floor, boolean magnetometerLow,
      SessionEnd end) {
    this.elapsedS = elapsedS;
    this.walk = walk;
    this.part = part;
    this.scans = scans.deliveries();
    this.scansRefused = scans.refusals();
    this.scansFailed = scans.failures();
    this.wifiReadings = scans.newReadings();
    this.throttling = scans.throttling();
    this.silentS = silentS;
    this.bleReadings = bleReadings;
    this.presses = presses;
    this.clockJumpMs = clockJumpMs;
    this.floor = floor;
    this.magnetometerLow = magnetometerLow;
    this.end = end;
  }
}
