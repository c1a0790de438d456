package org.vislam2tag.app.record;

import org.vislam2tag.app.R;
import org.vislam2tag.app.Words;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.record.TrackingState;
import org.vislam2tag.core.session.RecorderStatus;
import org.vislam2tag.core.walk.WalkStatus;
import org.vislam2tag.core.walk.Warning;

/** The recording's status in the collector's words. */
final class StatusText {
  /** With fewer the walk cannot be placed in the building. */
  private static final int FEWEST_LANDMARKS = 2;
  /** Labels worse than this are no better than what many positioning systems reach, m. */
  private static final double GOOD_M = 0.5;

  private final Words words;

  StatusText(Words words) {
    this.words = words;
  }

  /** Time, way, frame rate. */
  String walk(RecorderStatus status) {
    long seconds = (long) status.elapsedS;
    return words.of(R.string.status_walk, seconds / 60, seconds % 60, status.walk.walkedM, status.walk.framesPerS);
  }

  /** Whether the tracker knows where the phone is, and if not, why. */
  String tracking(WalkStatus walk) {
    if (walk.tracking == TrackingState.TRACKING) {
      return words.of(R.string.tracking_good);
    }
    return words.of(walk.tracking == null ? R.string.tracking_no_camera : reason(walk.failure));
  }

  /** Landmarks seen, and how long ago the last one was. */
  String landmarks(WalkStatus walk) {
    if (walk.lastLandmark == null) {
      return words.of(R.string.status_no_landmark_yet, walk.sinceLandmarkS, walk.sinceLandmarkM);
    }
    return words.of(R.string.status_landmarks, walk.landmarksSeen, walk.lastLandmark, walk.sinceLandmarkS, walk.sinceLandmarkM);
  }

  /** Scans, and whether they are held down. */
  String scans(RecorderStatus status) {
    String scans = words.of(R.string.status_scans, status.scans, status.wifiReadings, status.bleReadings);
    boolean throttled = "on".equals(status.throttling) || !"off".equals(status.throttling) && status.scansRefused > 0;
    return throttled ? scans + " " + words.of(R.string.status_throttled) : scans;
  }

  /** What a collector should know before leaving: a line each for landmarks, losses and radio. */
  String summary(RecorderStatus status) {
    WalkStatus walk = status.walk;
    return words.of(R.string.summary_walk, walk.walkedM, walk.landmarksSeen, walk.worst.metres) + "\n" + expected(walk)
        + words.of(R.string.summary_lost, walk.lostInAllS) + "\n" + scans(status) + silence(status);
  }

  /** How far off positions are expected to be at worst, and where to walk again if that is much. */
  private String expected(WalkStatus walk) {
    if (walk.landmarksSeen < FEWEST_LANDMARKS) {
      return words.of(R.string.summary_not_placed) + "\n";
    }
    String line = words.of(R.string.summary_expected, walk.worst.sigmaM()) + "\n";
    if (walk.worst.sigmaM() <= GOOD_M) {
      return line;
    }
    String from = walk.worst.from == null ? words.of(R.string.walk_start) : walk.worst.from;
    String to = walk.worst.to == null ? words.of(R.string.walk_end) : walk.worst.to;
    return line + words.of(R.string.summary_walk_again, from, to, walk.worst.metres) + "\n";
  }

  /** A line for each radio that heard nothing while the screen was off, and what to do. */
  private String silence(RecorderStatus status) {
    StringBuilder lines = new StringBuilder();
    status.silentS.forEach((radio, seconds) -> {
      if (seconds > 0) {
        lines.append("\n").append(words.of(radio == Radio.WIFI ? R.string.summary_wifi_silent : R.string.summary_ble_silent, seconds));
      }
    });
    return lines.length() == 0 ? "" : lines.append(" ").append(words.of(R.string.stopped_remedy)).toString();
  }

  /** What is left on the phone. */
  String supplies(long freeBytes, int batteryPercent) {
    return words.of(R.string.status_supplies, freeBytes / 1e9, batteryPercent);
  }

  /**
   * That the phone's clock was set, which the tables' times do not follow, and how to calibrate the magnetometer while it wants
   * that, a line each; empty where there is neither.
   */
  String hints(RecorderStatus status) {
    String clock = status.clockJumpMs == 0 ? "" : words.of(R.string.status_clock_changed, status.clockJumpMs / 1000.0);
    String magnetometer = status.magnetometerLow ? words.of(R.string.calibrate_magnetometer) : "";
    return clock + (clock.isEmpty() || magnetometer.isEmpty() ? "" : "\n") + magnetometer;
  }

  /** The warnings that are on, a line each; empty where there is none. */
  String warnings(WalkStatus walk) {
    StringBuilder lines = new StringBuilder();
    for (Warning warning : walk.warnings) {
      lines.append(lines.length() == 0 ? "" : "\n").append(words.of(sentence(warning)));
    }
    return lines.toString();
  }

  private static int sentence(Warning warning) {
    switch (warning) {
      case NO_LANDMARK:
        return R.string.warning_no_landmark;
      case TOO_FAST:
        return R.string.warning_too_fast;
      default:
        return R.string.warning_tracking;
    }
  }

  private static int reason(String failure) {
    switch (failure) {
      case "INSUFFICIENT_LIGHT":
        return R.string.tracking_dark;
      case "EXCESSIVE_MOTION":
        return R.string.tracking_motion;
      case "INSUFFICIENT_FEATURES":
        return R.string.tracking_features;
      case "CAMERA_UNAVAILABLE":
        return R.string.tracking_no_camera;
      default:
        return R.string.tracking_lost;
    }
  }
}
