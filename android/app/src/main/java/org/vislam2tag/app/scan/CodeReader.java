package org.vislam2tag.app.scan;

import com.google.zxing.Binarizer;
import com.google.zxing.BinaryBitmap;
import com.google.zxing.DecodeHintType;
import com.google.zxing.LuminanceSource;
import com.google.zxing.PlanarYUVLuminanceSource;
import com.google.zxing.ReaderException;
import com.google.zxing.common.GlobalHistogramBinarizer;
import com.google.zxing.common.HybridBinarizer;
import com.google.zxing.qrcode.QRCodeReader;
import java.util.Collections;
import java.util.Map;

/** Reads the QR code in a picture, whichever way it is turned. */
final class CodeReader {
  private static final Map<DecodeHintType, ?> HINTS = Collections.singletonMap(DecodeHintType.TRY_HARDER, Boolean.TRUE);

  private CodeReader() {}

  /** The code's text; null where there is none that can be read. {@code grey} holds rows of {@code stride} bytes. */
  static String read(byte[] grey, int stride, int width, int height) {
    LuminanceSource picture = new PlanarYUVLuminanceSource(grey, stride, height, 0, 0, width, height, false);
    String dark = text(picture);
    return dark == null ? text(picture.invert()) : dark; // a terminal may show light on dark
  }

  /** One threshold for all of the picture reads some codes that one for each part of it does not. */
  private static String text(LuminanceSource picture) {
    String local = text(new HybridBinarizer(picture));
    return local == null ? text(new GlobalHistogramBinarizer(picture)) : local;
  }

  private static String text(Binarizer picture) {
    try {
      return new QRCodeReader().decode(new BinaryBitmap(picture), HINTS).getText();
    } catch (ReaderException e) {
      return null;
    }
  }
}
