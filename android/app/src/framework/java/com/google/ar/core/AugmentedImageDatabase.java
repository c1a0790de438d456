package com.google.ar.core;

import java.io.OutputStream;

/** Stands for ARCore's class of this name: it stays empty. */
public class AugmentedImageDatabase {
  public AugmentedImageDatabase(Session session) {}

  public void serialize(OutputStream into) {}
}
