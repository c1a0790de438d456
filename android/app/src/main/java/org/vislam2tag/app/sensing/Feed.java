package org.vislam2tag.app.sensing;

import org.vislam2tag.core.session.Recorder;

/** Something that feeds a recorder while a session runs. */
public interface Feed {
  /** Begins. */
  void start(Recorder recorder);

  /** Ends; harmless where it never began. */
  void stop();
}
