package org.vislam2tag.app.sensing;

import android.media.AudioManager;
import android.os.Handler;
import org.vislam2tag.core.session.Recorder;

/** Notices phone calls, which take microphone and attention and often the screen; no permission is needed for that. */
public final class Calls implements Feed {
  private static final long LOOK_MS = 1000;

  private final AudioManager audio;
  private final Handler handler;
  private final Runnable look = this::look;
  private Recorder recorder;
  private boolean inCall;

  public Calls(AudioManager audio, Handler handler) {
    this.audio = audio;
    this.handler = handler;
  }

  @Override public void start(Recorder into) {
    recorder = into;
    handler.post(look);
  }

  @Override public void stop() {
    handler.removeCallbacks(look);
  }

  /** Looks, and looks again soon. */
  void look() {
    boolean now = audio.getMode() != AudioManager.MODE_NORMAL;
    if (now && !inCall) {
      recorder.event("phone_call", "");
    }
    inCall = now;
    handler.postDelayed(look, LOOK_MS);
  }
}
