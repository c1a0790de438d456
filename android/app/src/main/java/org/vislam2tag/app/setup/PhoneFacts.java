package org.vislam2tag.app.setup;

import java.util.ArrayList;
import java.util.Collections;
import java.util.List;
import org.vislam2tag.core.session.RecorderSettings;

/** What was found of the phone before a start. */
public final class PhoneFacts {
  /** Whether there is ARCore. */
  public enum ArCore { READY, BEING_LOOKED_UP, NEEDS_INSTALL, UNSUPPORTED }

  ArCore arCore = ArCore.READY;
  boolean cameraAllowed = true;
  boolean locationAllowed = true;
  boolean bluetoothAllowed = true;
  boolean locationOn = true;
  boolean wifiOn = true;
  boolean bluetoothOn = true;
  boolean scansThrottled;
  List<String> missingSensors = Collections.emptyList();
  int landmarks;
  List<String> refusedLandmarks = Collections.emptyList();
  long freeBytes = Long.MAX_VALUE;

  /** All that stands in the way, what matters most first. */
  List<Problem> problems() {
    List<Problem> found = new ArrayList<>();
    add(found, Problem.NO_ARCORE, arCore == ArCore.UNSUPPORTED);
    add(found, Problem.ARCORE_NEEDS_INSTALL, arCore == ArCore.NEEDS_INSTALL);
    add(found, Problem.NO_CAMERA_PERMISSION, !cameraAllowed);
    add(found, Problem.NO_LANDMARKS, landmarks == 0);
    add(found, Problem.LANDMARKS_REFUSED, !refusedLandmarks.isEmpty());
    add(found, Problem.NO_LOCATION_PERMISSION, !locationAllowed);
    add(found, Problem.LOCATION_OFF, !locationOn);
    add(found, Problem.WIFI_OFF, !wifiOn);
    add(found, Problem.SCANS_THROTTLED, scansThrottled);
    add(found, Problem.NO_BLUETOOTH_PERMISSION, !bluetoothAllowed);
    add(found, Problem.BLUETOOTH_OFF, !bluetoothOn);
    add(found, Problem.SENSORS_MISSING, !missingSensors.isEmpty());
    add(found, Problem.STORAGE_LOW, freeBytes < RecorderSettings.usual().lowBytes);
    return found;
  }

  /** Events that say in the session what it began with; what else lacks, who feeds the recorder tells. */
  List<String> events(boolean withoutCamera) {
    List<String> events = new ArrayList<>();
    if (withoutCamera) {
      events.add("without_camera");
    }
    for (Problem problem : problems()) {
      if (problem.event != null) {
        events.add(problem.event);
      }
    }
    return events;
  }

  /** The names that a problem's sentence tells. */
  String names(Problem problem) {
    switch (problem) {
      case LANDMARKS_REFUSED:
        return String.join(", ", refusedLandmarks);
      case SENSORS_MISSING:
        return String.join(", ", missingSensors);
      case STORAGE_LOW:
        return Long.toString(freeBytes >> 20);
      default:
        return "";
    }
  }

  private static void add(List<Problem> found, Problem problem, boolean isSo) {
    if (isSo) {
      found.add(problem);
    }
  }
}
