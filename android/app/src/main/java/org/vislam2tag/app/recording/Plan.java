package org.vislam2tag.app.recording;

import java.util.List;
import org.vislam2tag.app.ar.LandmarkImages;

/** What the collector chose before the start. */
public final class Plan {
  public final String site;
  public final int floor;
  public final String device;
  public final String note;
  /** Hz, or {@link org.vislam2tag.core.session.SensorOn#FASTEST}. */
  public final double sensorRateHz;
  public final LandmarkImages landmarks;
  /** Not so where the collector walks without it and taps the plan. */
  public final boolean withCamera;
  /** Are a script and ARCore's own recording, with the camera's images, kept beside the session? */
  public final boolean forDevelopers;
  /** Names of events that say what lacks from the start. */
  public final List<String> eventsAtStart;

  public Plan(String site, int floor, String device, String note, double sensorRateHz, LandmarkImages landmarks,
      boolean withCamera, boolean forDevelopers, List<String> eventsAtStart) {
    this.site = site;
    this.floor = floor;
    this.device = device;
    this.note = note;
    this.sensorRateHz = sensorRateHz;
    this.landmarks = landmarks;
    this.withCamera = withCamera;
    this.forDevelopers = forDevelopers;
    this.eventsAtStart = eventsAtStart;
  }
}
