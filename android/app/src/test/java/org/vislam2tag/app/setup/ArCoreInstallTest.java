package org.vislam2tag.app.setup;

import static org.junit.Assert.assertEquals;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.never;
import static org.mockito.Mockito.verify;
import static org.mockito.Mockito.when;

import com.google.ar.core.ArCoreApk;
import com.google.ar.core.ArCoreApk.InstallStatus;
import com.google.ar.core.exceptions.FatalException;
import com.google.ar.core.exceptions.UnavailableDeviceNotCompatibleException;
import com.google.ar.core.exceptions.UnavailableUserDeclinedInstallationException;
import org.junit.Test;
import org.vislam2tag.app.R;

public class ArCoreInstallTest {
  private final ArCoreApk arCore = mock(ArCoreApk.class);
  private final ArCoreInstall install = new ArCoreInstall(arCore);

  @Test public void whoComesBackWithoutItIsToldOnce() throws Exception {
    when(arCore.requestInstall(null, true)).thenReturn(InstallStatus.INSTALL_REQUESTED);
    when(arCore.requestInstall(null, false)).thenAnswer(call -> {
      throw new UnavailableUserDeclinedInstallationException();
    });
    assertEquals(ArCoreInstall.NOTHING, install.ask(null));
    assertEquals(R.string.arcore_declined, install.returned(null));
    assertEquals(ArCoreInstall.NOTHING, install.returned(null));
  }

  @Test public void nothingIsAskedOfGooglePlayByItself() throws Exception {
    assertEquals(ArCoreInstall.NOTHING, install.returned(null));
    verify(arCore, never()).requestInstall(null, false);
  }

  @Test public void onceInstalledNothingIsTold() throws Exception {
    when(arCore.requestInstall(null, true)).thenReturn(InstallStatus.INSTALL_REQUESTED);
    when(arCore.requestInstall(null, false)).thenReturn(InstallStatus.INSTALLED);
    install.ask(null);
    assertEquals(ArCoreInstall.NOTHING, install.returned(null));
  }

  @Test public void whatItThrowsIsASentence() throws Exception {
    when(arCore.requestInstall(null, true)).thenAnswer(call -> {
      throw new UnavailableDeviceNotCompatibleException();
    }).thenThrow(new FatalException("Requesting installation too frequently"));
    assertEquals(R.string.problem_no_arcore, install.ask(null));
    assertEquals(R.string.arcore_try_again, install.ask(null));
  }
}
