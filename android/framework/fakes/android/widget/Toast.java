package android.widget;

import android.content.Context;
import java.util.List;
import java.util.concurrent.CopyOnWriteArrayList;

/** Sentences that are shown for a moment: here they stay. */
public class Toast {
  public static final int LENGTH_SHORT = 0;
  public static final int LENGTH_LONG = 1;
  /** All that was shown. */
  public static final List<String> SHOWN = new CopyOnWriteArrayList<>();

  private final String sentence;

  private Toast(String sentence) {
    this.sentence = sentence;
  }

  public static Toast makeText(Context context, CharSequence sentence, int duration) {
    return new Toast(sentence.toString());
  }

  public static Toast makeText(Context context, int sentence, int duration) {
    return makeText(context, context.getString(sentence), duration);
  }

  public void show() {
    SHOWN.add(sentence);
  }
}
