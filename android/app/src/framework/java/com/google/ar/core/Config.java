package com.google.ar.core;

/** Stands for ARCore's class of this name: it takes everything. */
public class Config {
  public enum UpdateMode { BLOCKING, LATEST_CAMERA_IMAGE }

  public enum FocusMode { FIXED, AUTO }

  public enum PlaneFindingMode { DISABLED, HORIZONTAL, VERTICAL, HORIZONTAL_AND_VERTICAL }

  public enum LightEstimationMode { DISABLED, AMBIENT_INTENSITY, ENVIRONMENTAL_HDR }

  public Config(Session session) {}

  public Config setAugmentedImageDatabase(AugmentedImageDatabase images) {
    return this;
  }

  public Config setUpdateMode(UpdateMode mode) {
    return this;
  }

  public Config setFocusMode(FocusMode mode) {
    return this;
  }

  public Config setPlaneFindingMode(PlaneFindingMode mode) {
    return this;
  }

  public Config setLightEstimationMode(LightEstimationMode mode) {
    return this;
  }
}
