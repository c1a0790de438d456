package android.icu.util;

import java.util.Locale;

/** A language, all of whose are written from left to right here. */
public final class ULocale {
  private final Locale locale;

  private ULocale(Locale locale) {
    this.locale = locale;
  }

  public static ULocale forLocale(Locale locale) {
    return new ULocale(locale);
  }

  public static ULocale addLikelySubtags(ULocale locale) {
    return locale;
  }

  public boolean isRightToLeft() {
    return false;
  }

  public String getScript() {
    return "Latn";
  }

  public Locale toLocale() {
    return locale;
  }
}
