package org.vislam2tag.core.table;

import static org.junit.Assert.assertEquals;

import java.util.Locale;
import org.junit.After;
import org.junit.Before;
import org.junit.Test;

public class RowTest {
  private final Locale usual = Locale.getDefault();

  @Before public void speakGerman() {
    Locale.setDefault(Locale.GERMANY);
  }

  @After public void speakAsBefore() {
    Locale.setDefault(usual);
  }

  @Test public void numbersHaveAPointInEveryLocale() {
    for (Locale locale : new Locale[] {Locale.GERMANY, new Locale("ar", "EG"), new Locale("th", "TH", "TH")}) {
      Locale.setDefault(locale);
      assertEquals("-1234567.5,1.0E-5,-61,9223372036854775807\n",
          new Row().number(-1234567.5f).number(1e-5f).integer(-61).integer(Long.MAX_VALUE).line());
    }
  }

  @Test public void whatIsNoNumberIsEmpty() {
    assertEquals(",,,7\n", new Row().number(Float.NaN).number(Float.NEGATIVE_INFINITY).integer(0, 0).integer(7, 0).line());
  }

  @Test public void textIsQuotedWhereItMustBe() {
    assertEquals("\"a,b\",\"say \"\"hi\"\"\",\" x\",\"x \",a;b',,\n",
        new Row().text("a,b").text("say \"hi\"").text(" x").text("x ").text("a;b'").text("").text(null).line());
  }

  @Test public void aLineIsARow() {
    assertEquals("a\uFFFDb\uFFFDc\uFFFD\uFFFD\n", new Row().text("a\nb\rc\0\u007F").line());
  }

  @Test public void halvesOfCharactersAreReplacedAndWholeOnesKept() {
    assertEquals("\uFFFDx\uFFFD,\uD83D\uDE00\n", new Row().text("\uDE00x\uD83D").text("\uD83D\uDE00").line());
  }
}
