package org.vislam2tag.app.setup;

import android.app.Activity;
import android.content.ActivityNotFoundException;
import android.content.Intent;
import android.os.Build;
import android.provider.Settings;
import android.view.View;
import android.widget.Button;
import android.widget.LinearLayout;
import android.widget.TextView;
import android.widget.Toast;
import org.vislam2tag.app.R;

/** How to let the phone scan as often as it can: what is done, and what is to do, step by step. */
public final class UnlockActivity extends Activity {
  private static final int ASK = 1;

  /** The collector comes back from the phone's settings: the steps are looked at again. */
  @Override protected void onResume() {
    super.onResume();
    setContentView(R.layout.unlock);
    LinearLayout list = findViewById(R.id.steps);
    new PhoneLook(this).scans().steps(step -> list.addView(row(list, step)));
  }

  private View row(LinearLayout list, ScanFacts.Step step) {
    View row = getLayoutInflater().inflate(R.layout.problem, list, false);
    String words = list.getChildCount() + 1 + ". " + getString(mark(step.state)) + " " + getString(step.sentence);
    ((TextView) row.findViewById(R.id.sentence)).setText(words);
    Button fix = row.findViewById(R.id.fix);
    boolean nothing = step.fix == Problem.Fix.NONE || step.state == ScanFacts.State.DONE;
    fix.setVisibility(nothing ? View.GONE : View.VISIBLE);
    fix.setOnClickListener(view -> fix(step.fix));
    if (step.state == ScanFacts.State.DONE) {
      row.setBackgroundColor(0);
    }
    return row;
  }

  private static int mark(ScanFacts.State state) {
    switch (state) {
      case DONE:
        return R.string.unlock_done;
      case TO_DO:
        return R.string.unlock_to_do;
      default:
        return R.string.unlock_not_told;
    }
  }

  private void fix(Problem.Fix fix) {
    if (fix == Problem.Fix.ASK_PERMISSIONS) {
      requestPermissions(Permissions.needed(Build.VERSION.SDK_INT).toArray(new String[0]), ASK);
      return;
    }
    try {
      startActivity(fix.settings(getPackageName()));
    } catch (ActivityNotFoundException e) { // makers leave pages out
      startActivity(new Intent(Settings.ACTION_SETTINGS));
      Toast.makeText(this, R.string.unlock_no_page, Toast.LENGTH_LONG).show();
    }
  }
}
