package org.vislam2tag.core.record;

/** State of the camera, an image or an anchor; the names are ARCore's {@code TrackingState} and the tables' words. */
public enum TrackingState { TRACKING, PAUSED, STOPPED }
