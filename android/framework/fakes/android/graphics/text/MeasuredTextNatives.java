package android.graphics.text;

import android.graphics.Handles;
import android.graphics.PaintState;
import java.util.ArrayList;
import java.util.List;

/** The widths of a text's chars. */
final class MeasuredTextNatives {
  private MeasuredTextNatives() {}

  /** A part of a text in one style: a paint, or a width where something stands in its place. */
  private static final class Run {
    int start;
    int end;
    PaintState paint;
    float width;
  }

  static long nInitBuilder() {
    return Handles.of(new ArrayList<Run>());
  }

  static void nAddStyleRun(long builder, long paint, int start, int end, boolean rtl) {
    Run run = new Run();
    run.start = start;
    run.end = end;
    run.paint = Handles.<PaintState>get(paint).clone();
    Handles.<List<Run>>get(builder).add(run);
  }

  static void nAddReplacementRun(long builder, long paint, int start, int end, float width) {
    Run run = new Run();
    run.start = start;
    run.end = end;
    run.width = width;
    Handles.<List<Run>>get(builder).add(run);
  }

  static long nBuildMeasuredText(long builder, long hint, char[] text, boolean hyphens, boolean layout) {
    float[] widths = new float[text.length];
    for (Run run : Handles.<List<Run>>get(builder)) {
      if (run.paint == null) {
        widths[run.start] = run.width;
      } else {
        System.arraycopy(run.paint.widths(text, run.start, run.end - run.start), 0, widths, run.start, run.end - run.start);
      }
    }
    return Handles.of(widths);
  }

  static float nGetWidth(long measured, int start, int end) {
    float[] widths = Handles.get(measured);
    float sum = 0;
    for (int i = start; i < end; i++) {
      sum += widths[i];
    }
    return sum;
  }

  static float nGetCharWidthAt(long measured, int offset) {
    return Handles.<float[]>get(measured)[offset];
  }
}
