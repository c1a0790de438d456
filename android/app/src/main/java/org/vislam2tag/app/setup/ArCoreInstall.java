package org.vislam2tag.app.setup;

import android.app.Activity;
import com.google.ar.core.ArCoreApk;
import com.google.ar.core.exceptions.FatalException;
import com.google.ar.core.exceptions.UnavailableException;
import com.google.ar.core.exceptions.UnavailableUserDeclinedInstallationException;
import org.vislam2tag.app.R;

/** Has Google Play Services for AR installed, and tells what came of it. */
final class ArCoreInstall {
  /** Nothing to tell. */
  static final int NOTHING = 0;

  private final ArCoreApk arCore;
  private boolean asked;

  ArCoreInstall(ArCoreApk arCore) {
    this.arCore = arCore;
  }

  /** The collector asks for it: a page of Google Play comes, or the sentence of why not. */
  int ask(Activity screen) {
    return request(screen, true);
  }

  /** The screen is in front again: after a page of Google Play, the sentence of why it is still not installed. */
  int returned(Activity screen) {
    return asked ? request(screen, false) : NOTHING;
  }

  private int request(Activity screen, boolean byCollector) {
    asked = false;
    try {
      asked = arCore.requestInstall(screen, byCollector) == ArCoreApk.InstallStatus.INSTALL_REQUESTED;
      return NOTHING;
    } catch (UnavailableUserDeclinedInstallationException e) {
      return R.string.arcore_declined;
    } catch (UnavailableException e) {
      return R.string.problem_no_arcore;
    } catch (FatalException e) { // as it throws when it is asked again too soon
      return R.string.arcore_try_again;
    }
  }
}
