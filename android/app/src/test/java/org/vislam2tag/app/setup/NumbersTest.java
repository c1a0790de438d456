package org.vislam2tag.app.setup;

import static org.junit.Assert.assertEquals;

import java.util.Locale;
import org.junit.After;
import org.junit.Test;

public class NumbersTest {
  private final Locale before = Locale.getDefault();

  @After public void restore() {
    Locale.setDefault(before);
  }

  @Test public void commaAndPointAreTheSame() {
    assertEquals(0.185f, Numbers.metres("18,5", 1), 1e-6f);
    assertEquals(0.185f, Numbers.metres(" 18.5 ", 1), 1e-6f);
  }

  @Test public void noLengthLeavesWhatWas() {
    for (String text : new String[] {"", "x", "0", "-3", "NaN", "Infinity"}) {
      assertEquals(text, 0.18f, Numbers.metres(text, 0.18f), 0);
    }
  }

  @Test public void whatIsShownIsReadAgain() {
    for (Locale locale : new Locale[] {Locale.GERMANY, Locale.US}) {
      Locale.setDefault(locale);
      assertEquals(0.185f, Numbers.metres(Numbers.centimetres(0.185f), 1), 1e-6f);
    }
  }
}
