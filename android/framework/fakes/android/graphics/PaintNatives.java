package android.graphics;

/** Paints, with AWT's font metrics. */
final class PaintNatives {
  private PaintNatives() {}

  private static PaintState of(long paint) {
    return Handles.get(paint);
  }

  static long nInit() {
    return Handles.of(new PaintState());
  }

  static long nInitWithPaint(long paint) {
    return Handles.of(of(paint).clone());
  }

  static void nReset(long paint) {
    nSet(paint, nInit());
  }

  static void nSet(long to, long from) {
    PaintState a = of(to);
    PaintState b = of(from);
    a.colour = b.colour;
    a.style = b.style;
    a.flags = b.flags;
    a.align = b.align;
    a.textSize = b.textSize;
    a.strokeWidth = b.strokeWidth;
    a.letterSpacing = b.letterSpacing;
    a.typeface = b.typeface;
    a.filter = b.filter;
  }

  static int nGetStyle(long paint) {
    return of(paint).style;
  }

  static void nSetStyle(long paint, int style) {
    of(paint).style = style;
  }

  static int nGetFlags(long paint) {
    return of(paint).flags;
  }

  static void nSetFlags(long paint, int flags) {
    of(paint).flags = flags;
  }

  static int nGetTextAlign(long paint) {
    return of(paint).align;
  }

  static void nSetTextAlign(long paint, int align) {
    of(paint).align = align;
  }

  static void nSetColor(long paint, int colour) {
    of(paint).colour = colour;
  }

  static void nSetAlpha(long paint, int alpha) {
    of(paint).colour = of(paint).colour & 0xFFFFFF | alpha << 24;
  }

  static long nSetColorFilter(long paint, long filter) {
    of(paint).filter = Handles.get(filter);
    return filter;
  }

  static void nSetTypeface(long paint, long typeface) {
    of(paint).typeface = typeface == 0 ? 400 : typeface;
  }

  static float nGetTextSize(long paint) {
    return of(paint).textSize;
  }

  static void nSetTextSize(long paint, float size) {
    of(paint).textSize = size;
  }

  static float nGetTextScaleX(long paint) {
    return 1;
  }

  static float nGetLetterSpacing(long paint) {
    return of(paint).letterSpacing;
  }

  static void nSetLetterSpacing(long paint, float spacing) {
    of(paint).letterSpacing = spacing;
  }

  static float nGetStrokeWidth(long paint) {
    return of(paint).strokeWidth;
  }

  static void nSetStrokeWidth(long paint, float width) {
    of(paint).strokeWidth = width;
  }

  static void nSetUnderlineText(long paint, boolean underline) {
    int flags = of(paint).flags;
    of(paint).flags = underline ? flags | Paint.UNDERLINE_TEXT_FLAG : flags & ~Paint.UNDERLINE_TEXT_FLAG;
  }

  static float nGetFontMetrics(long paint, Paint.FontMetrics metrics) {
    return of(paint).metrics(metrics);
  }

  static int nGetFontMetricsInt(long paint, Paint.FontMetricsInt into) {
    Paint.FontMetrics metrics = new Paint.FontMetrics();
    of(paint).metrics(metrics);
    if (into != null) {
      into.ascent = Math.round(metrics.ascent);
      into.descent = Math.round(metrics.descent);
      into.top = (int) Math.floor(metrics.top);
      into.bottom = (int) Math.ceil(metrics.bottom);
    }
    return Math.round(metrics.descent) - Math.round(metrics.ascent);
  }

  static float nAscent(long paint) {
    Paint.FontMetrics metrics = new Paint.FontMetrics();
    of(paint).metrics(metrics);
    return metrics.ascent;
  }

  static float nDescent(long paint) {
    Paint.FontMetrics metrics = new Paint.FontMetrics();
    of(paint).metrics(metrics);
    return metrics.descent;
  }

  static float nGetTextAdvances(long paint, char[] text, int start, int count, int contextStart, int contextCount, int bidi,
      float[] advances, int at) {
    if (advances != null) {
      System.arraycopy(of(paint).widths(text, start, count), 0, advances, at, count);
    }
    return of(paint).width(text, start, count);
  }

  static float nGetTextAdvances(long paint, String text, int start, int end, int contextStart, int contextEnd, int bidi,
      float[] advances, int at) {
    return nGetTextAdvances(paint, text.toCharArray(), start, end - start, 0, 0, bidi, advances, at);
  }

  static float nGetRunAdvance(long paint, char[] text, int start, int end, int contextStart, int contextEnd, boolean rtl,
      int offset) {
    return of(paint).width(text, start, offset - start);
  }

  static int nGetOffsetForAdvance(long paint, char[] text, int start, int end, int contextStart, int contextEnd, boolean rtl,
      float advance) {
    int offset = start;
    while (offset < end && of(paint).width(text, start, offset + 1 - start) <= advance) {
      offset++;
    }
    return offset;
  }

  static int nBreakText(long paint, char[] text, int start, int count, float most, int bidi, float[] measured) {
    int fits = nGetOffsetForAdvance(paint, text, start, start + count, 0, 0, false, most) - start;
    if (measured != null) {
      measured[0] = of(paint).width(text, start, fits);
    }
    return fits;
  }

  static int nBreakText(long paint, String text, boolean forwards, float most, int bidi, float[] measured) {
    return nBreakText(paint, text.toCharArray(), 0, text.length(), most, bidi, measured);
  }
}
