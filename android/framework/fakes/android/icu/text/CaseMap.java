package android.icu.text;

import java.io.IOException;
import java.util.Locale;

/** Capitals, as Java makes them. */
public abstract class CaseMap {
  private static final Upper UPPER = new Upper();

  public static Upper toUpper() {
    return UPPER;
  }

  public static final class Upper extends CaseMap {
    public <A extends Appendable> A apply(Locale locale, CharSequence text, A into, Edits edits) {
      String capitals = text.toString().toUpperCase(locale);
      edits.changed = !capitals.contentEquals(text);
      try {
        into.append(capitals);
      } catch (IOException e) {
        throw new IllegalStateException("memory takes text", e);
      }
      return into;
    }
  }
}
