package org.vislam2tag.core.handover;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;
import static org.junit.Assert.fail;

import java.util.Locale;
import org.junit.Test;

public class ReceiverTest {
  private static final String TOKEN = "ABCDEFGHIJKL2345";

  @Test public void aQrCodeAndALinkSayTheSame() {
    for (String scheme : new String[] {"http", "vislam2tag", "HTTP"}) {
      Receiver receiver = Receiver.ofLink(" " + scheme + "://192.168.1.20:8765/#" + TOKEN + "\n");
      assertEquals("192.168.1.20:8765", receiver.address());
      assertEquals(TOKEN, receiver.token);
    }
    Receiver six = Receiver.ofLink("http://[fe80::1]:80/#" + TOKEN);
    assertEquals("fe80::1", six.host);
    assertEquals("[fe80::1]:80", six.address());
  }

  @Test public void typedTokensMayHaveHyphensBlanksAndSmallLetters() {
    Locale usual = Locale.getDefault();
    Locale.setDefault(Locale.forLanguageTag("tr-TR"));
    try {
      assertEquals(TOKEN, Receiver.ofWords(" laptop.local:8765 ", "abcd-efgh ijkl-2345").token);
      assertEquals("laptop.local", Receiver.ofWords("laptop.local:8765", TOKEN).host);
    } finally {
      Locale.setDefault(usual);
    }
  }

  @Test public void whatIsNoReceiverIsSaid() {
    String[] links = {"", "hello", "https://1.2.3.4:80/#" + TOKEN, "http://1.2.3.4:80/", "http://1.2.3.4/#" + TOKEN,
        "http://1.2.3.4:70000/#" + TOKEN, "http://1.2.3.4:80/#ABC", "http://1.2.3.4:80/#ABCDEFGHIJKL0189", "http://a b:80/#" + TOKEN};
    for (String link : links) {
      try {
        Receiver.ofLink(link);
        fail(link);
      } catch (IllegalArgumentException e) {
        assertTrue(e.getMessage().length() > 10);
      }
    }
  }
}
