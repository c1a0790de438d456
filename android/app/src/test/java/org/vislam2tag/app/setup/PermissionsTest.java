package org.vislam2tag.app.setup;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.when;

import android.content.Context;
import android.content.pm.PackageManager;
import org.junit.Test;

public class PermissionsTest {
  @Test public void newerAndroidsAskForMore() {
    assertEquals(3, Permissions.needed(26).size());
    assertTrue(Permissions.needed(31).contains(Permissions.BLUETOOTH_SCAN));
    assertTrue(Permissions.needed(33).contains(Permissions.POST_NOTIFICATIONS));
  }

  @Test public void aQuestionThatIsNoLongerShownIsNoticed() {
    int no = PackageManager.PERMISSION_DENIED;
    assertTrue(Permissions.isAskedNoMore("android.permission.CAMERA", no, false));
    assertFalse(Permissions.isAskedNoMore("android.permission.CAMERA", no, true));
    assertFalse(Permissions.isAskedNoMore("android.permission.CAMERA", PackageManager.PERMISSION_GRANTED, false));
    assertFalse(Permissions.isAskedNoMore(Permissions.POST_NOTIFICATIONS, no, false));
  }

  @Test public void bluetoothHasItsOwnPermissionFromAndroid12() {
    Context context = mock(Context.class);
    when(context.checkSelfPermission(Permissions.BLUETOOTH_SCAN)).thenReturn(PackageManager.PERMISSION_DENIED);
    assertTrue(Permissions.bluetoothAllowed(context, 30));
    assertFalse(Permissions.bluetoothAllowed(context, 31));
  }
}
