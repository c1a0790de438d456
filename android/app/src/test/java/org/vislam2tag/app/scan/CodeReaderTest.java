package org.vislam2tag.app.scan;

import static org.junit.Assert.assertEquals;

import org.junit.Test;
import org.vislam2tag.core.handover.Receiver;

public class CodeReaderTest {
  private static String read(double degrees, double moduleWidth, int blur, boolean inverted) throws Exception {
    byte[] grey = new CodePicture(degrees, moduleWidth, inverted).grey(blur);
    return CodeReader.read(grey, CodePicture.STRIDE, CodePicture.WIDTH, CodePicture.HEIGHT);
  }

  @Test public void theCodeIsReadWhicheverWayThePhoneIsTurned() throws Exception {
    for (double degrees : new double[] {0, 90, 180, 270, 10, 33, 45, 137}) {
      assertEquals(degrees + " degrees", CodePicture.TEXT, read(degrees, 7, 1, false));
    }
    assertEquals("192.168.1.20:8765", Receiver.ofLink(read(0, 7, 1, false)).address());
  }

  @Test public void theCodeIsReadOutOfFocus() throws Exception {
    assertEquals(CodePicture.TEXT, read(0, 7, 7, false)); // as wide as a module
    assertEquals(CodePicture.TEXT, read(20, 7, 5, false));
  }

  @Test public void theCodeIsReadFromFar() throws Exception {
    assertEquals(CodePicture.TEXT, read(5, 3, 2, false));
  }

  @Test public void aLightTerminalShowsItInverted() throws Exception {
    assertEquals(CodePicture.TEXT, read(15, 7, 3, true));
  }

  @Test public void whereThereIsNoCodeNothingIsRead() throws Exception {
    assertEquals(null, read(0, 0.6, 1, false)); // too small to tell
    assertEquals(null, CodeReader.read(new byte[64 * 64], 64, 64, 64));
  }
}
