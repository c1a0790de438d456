package org.vislam2tag.core.handover;

import java.nio.charset.StandardCharsets;
import java.security.GeneralSecurityException;
import java.security.MessageDigest;
import java.security.SecureRandom;
import javax.crypto.Mac;
import javax.crypto.spec.SecretKeySpec;

/** Proves to the computer, and it to the phone, that both know the token, which is never sent (docs/reference/phone-handover.md). */
final class Proof {
  private static final String PROTOCOL = "vislam2tag 2";
  private static final String ALGORITHM = "HmacSHA256";
  private static final SecureRandom RANDOM = new SecureRandom();

  private Proof() {}

  /** 32 hexadecimal digits that no other request has. */
  static String nonce() {
    byte[] bytes = new byte[16];
    RANDOM.nextBytes(bytes);
    return Sha256.hexadecimal(bytes);
  }

  /** MAC of a request; {@code offset} and {@code length} are its headers, empty where it has none. */
  static String ofRequest(String token, String method, String path, String offset, String length, String bodySha, String nonce) {
    return mac(token, "request", method, path, offset, length, bodySha, nonce);
  }

  /** MAC of the answer to the request with this nonce. */
  static String ofAnswer(String token, String nonce, int status, byte[] body) {
    return mac(token, "answer", nonce, Integer.toString(status), Sha256.of(body));
  }

  /** Does a MAC that was told equal the right one? */
  static boolean isSame(String told, String right) {
    return told != null && MessageDigest.isEqual(told.getBytes(StandardCharsets.UTF_8), right.getBytes(StandardCharsets.UTF_8));
  }

  private static String mac(String token, String... parts) {
    try {
      Mac mac = Mac.getInstance(ALGORITHM);
      mac.init(new SecretKeySpec(token.getBytes(StandardCharsets.US_ASCII), ALGORITHM));
      String text = PROTOCOL + "\n" + String.join("\n", parts);
      return Sha256.hexadecimal(mac.doFinal(text.getBytes(StandardCharsets.UTF_8)));
    } catch (GeneralSecurityException e) {
      throw new IllegalStateException("every Java has " + ALGORITHM, e);
    }
  }
}
