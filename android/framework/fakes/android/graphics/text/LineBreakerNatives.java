package android.graphics.text;

import android.graphics.Handles;
import java.text.BreakIterator;
import java.util.ArrayList;
import java.util.List;
import java.util.Locale;

/**
 * Lines as long as fit, broken where the JVM's break iterator allows; a word that fits no line is broken within. Android
 * then evens the lines out, without hyphens, by which a text rarely gets another number of lines.
 */
final class LineBreakerNatives {
  private LineBreakerNatives() {}

  private static final class Lines {
    final List<Integer> ends = new ArrayList<>();
    final List<Float> widths = new ArrayList<>();

    void add(int end, float width) {
      ends.add(end);
      widths.add(width);
    }
  }

  static long nInit(int strategy, int hyphens, boolean justified, int[] indents) {
    return 1;
  }

  static long nComputeLineBreaks(long breaker, char[] text, long measured, int length, float firstWidth, int firstCount,
      float restWidth, float[] stops, float stop, int indents) {
    float[] widths = Handles.get(measured);
    BreakIterator allowed = BreakIterator.getLineInstance(Locale.ROOT);
    allowed.setText(new String(text, 0, length));
    Lines lines = new Lines();
    int begin = 0;
    while (begin < length) {
      float most = lines.ends.size() < firstCount ? firstWidth : restWidth;
      int end = end(text, widths, allowed, begin, length, most);
      lines.add(end, width(text, widths, begin, end));
      begin = end;
    }
    return Handles.of(lines);
  }

  private static int end(char[] text, float[] widths, BreakIterator allowed, int begin, int length, float most) {
    int best = -1;
    for (int at = allowed.following(begin); at != BreakIterator.DONE && at <= length; at = allowed.next()) {
      if (width(text, widths, begin, at) > most) {
        break;
      }
      best = at;
      if (at == length || text[at - 1] == '\n') {
        return at;
      }
    }
    if (best > 0) {
      return best;
    }
    int within = begin + 1;
    while (within < length && width(text, widths, begin, within + 1) <= most) {
      within++;
    }
    return within;
  }

  /** Blanks at a line's end take no place. */
  private static float width(char[] text, float[] widths, int begin, int end) {
    int last = end;
    while (last > begin && Character.isWhitespace(text[last - 1])) {
      last--;
    }
    float sum = 0;
    for (int i = begin; i < last; i++) {
      sum += widths[i];
    }
    return sum;
  }

  static int nGetLineCount(long lines) {
    return Handles.<Lines>get(lines).ends.size();
  }

  static int nGetLineBreakOffset(long lines, int line) {
    return Handles.<Lines>get(lines).ends.get(line);
  }

  static float nGetLineWidth(long lines, int line) {
    return Handles.<Lines>get(lines).widths.get(line);
  }
}
