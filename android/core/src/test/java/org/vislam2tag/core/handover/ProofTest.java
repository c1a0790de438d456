package org.vislam2tag.core.handover;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;

import java.nio.charset.StandardCharsets;
import org.junit.Test;

public class ProofTest {
  private static final String TOKEN = "ABCDEFGHIJKLMNOP";
  private static final String NONCE = "00112233445566778899aabbccddeeff";
  private static final byte[] BODY = "abc".getBytes(StandardCharsets.US_ASCII);

  /** The computer's tests have the same numbers (tests/studio/receiving/test_token.py). */
  @Test public void bothSidesMakeTheSameMac() {
    String path = "/v2/uploads/" + Sha256.of(BODY);
    assertEquals("f63dedcc47a3c9969ee1dc6abb7d25d7860c843bdda7f3997d05a65f0640d54f",
        Proof.ofRequest(TOKEN, "PATCH", path, "0", "3", Sha256.of(BODY), NONCE));
    assertEquals("d5d51f2c835f59365ff82559512b2c578135ea7c8bbcb94022e18e67b43be3a3", Proof.ofAnswer(TOKEN, NONCE, 200, BODY));
  }

  @Test public void aMissingOrOtherMacIsWrong() {
    assertTrue(Proof.isSame("ab", "ab"));
    assertFalse(Proof.isSame("ac", "ab"));
    assertFalse(Proof.isSame(null, "ab"));
  }
}
