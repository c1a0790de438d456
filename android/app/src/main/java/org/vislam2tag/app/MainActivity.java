package org.vislam2tag.app;

import android.app.Activity;
import android.os.Bundle;

/** The app's screen. */
public final class MainActivity extends Activity {
  @Override protected void onCreate(Bundle saved) {
    super.onCreate(saved);
    setTitle(R.string.app_name);
  }
}
