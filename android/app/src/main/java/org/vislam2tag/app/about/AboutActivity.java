package org.vislam2tag.app.about;

import android.app.Activity;
import android.os.Bundle;
import android.text.method.LinkMovementMethod;
import android.widget.TextView;
import org.vislam2tag.app.R;

/** What the app is, what it uses, what it does with data. */
public final class AboutActivity extends Activity {
  @Override protected void onCreate(Bundle saved) {
    super.onCreate(saved);
    setContentView(R.layout.about);
    ((TextView) findViewById(R.id.arcore)).setMovementMethod(LinkMovementMethod.getInstance());
  }
}
