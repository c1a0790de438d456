package org.vislam2tag.app.ar;

import com.google.ar.core.Frame;
import com.google.ar.core.exceptions.CameraNotAvailableException;
import java.io.Closeable;
import org.vislam2tag.core.clock.Clocks;
import org.vislam2tag.core.session.Recorder;

/** What {@link ArSession} is to those who drive it. */
interface Tracker extends Closeable {
  /** Starts the camera, whose image goes into the texture. */
  void resume(int texture, int rotation, int width, int height) throws CameraNotAvailableException;

  /** The screen has another size or is turned. */
  void resize(int rotation, int width, int height);

  /** The newest frame; it is recorded where {@code recorder} is not null. */
  Frame update(Recorder recorder, Clocks clocks) throws CameraNotAvailableException;

  /** Gives the camera back. */
  void pause();

  /** It is over. May take seconds. */
  @Override void close();
}
