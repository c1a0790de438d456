package org.vislam2tag.core.session;

import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.walk.Warning;

/** Is told what the collector must know. Called from any thread, without a lock held. */
public interface RecorderListener {
  /** A warning came on ({@link RecorderStatus#warnings} tells which are on still). */
  void warning(Warning warning);

  /** A landmark came into view that was not in it for some seconds. */
  void caught(String landmark);

  /** With the screen off nothing is heard any more ({@link RecorderStatus#silentS} tells for how long). */
  void scansStopped(Radio radio);

  /** The session ended, by {@link Recorder#stop} or by itself. */
  void ended(SessionEnd end);
}
