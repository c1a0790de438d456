package org.vislam2tag.core.landmarks;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;

import org.junit.Test;
import org.vislam2tag.core.landmarks.Refusal.Reason;

public class ImageQualityTest {
  @Test public void aRichImageIsGoodAtAnySize() {
    for (int side : new int[] {300, 600, 1500}) {
      for (int seed = 0; seed < 5; seed++) {
        ImageQuality quality = ImageQuality.of(TestImages.leaves(side, side * 4 / 3, seed));
        assertNull(quality.words(), quality.fault());
      }
    }
  }

  @Test public void plainImagesAreRefusedWhyeverTheyArePlain() {
    GreyImage[] plain = {TestImages.flat(600, 600), TestImages.ramp(600, 600), TestImages.bars(600, 600), TestImages.sign(600, 600),
        TestImages.corner(600, 600)};
    for (GreyImage image : plain) {
      ImageQuality quality = ImageQuality.of(image);
      assertEquals(quality.words(), Reason.TOO_PLAIN, quality.fault());
    }
  }

  @Test public void edgesAreNoCorners() {
    assertEquals(0, ImageQuality.of(TestImages.bars(600, 600)).corners);
    assertEquals(4, ImageQuality.of(TestImages.sign(600, 600)).corners);
  }

  @Test public void paleImagesAreRefused() {
    GreyImage rich = TestImages.leaves(400, 400, 1);
    byte[] pale = new byte[400 * 400];
    for (int i = 0; i < pale.length; i++) {
      pale[i] = (byte) (190 + rich.at(i % 400, i / 400) / 4);
    }
    ImageQuality quality = ImageQuality.of(new GreyImage(400, 400, pale));
    assertTrue("it has corners enough: " + quality.words(), quality.corners >= ImageQuality.LEAST_CORNERS);
    assertEquals(Reason.TOO_PLAIN, quality.fault());
  }

  @Test public void smallImagesAreRefused() {
    assertEquals(Reason.TOO_SMALL, ImageQuality.of(TestImages.leaves(1000, 299, 1)).fault());
  }

  @Test public void thinImagesAreNoTrouble() {
    assertEquals(Reason.TOO_SMALL, ImageQuality.of(TestImages.leaves(4000, 1, 1)).fault());
  }

  @Test public void coloursBecomeGreyAndTransparencyPaper() {
    int[] colours = {0xFFFFFFFF, 0xFF000000, 0x00000000, 0xFFFF0000, 0x80000000};
    GreyImage image = GreyImage.ofColours(5, 1, colours);
    int[] grey = {255, 0, 255, 76, 127};
    for (int x = 0; x < 5; x++) {
      assertEquals(grey[x], image.at(x, 0));
    }
  }

  @Test public void shrinkingTakesMeans() {
    GreyImage small = new GreyImage(4, 2, new byte[] {0, 100, (byte) 200, (byte) 200, 0, 100, (byte) 200, (byte) 200}).shrunk(2);
    assertEquals(2, small.width);
    assertEquals(1, small.height);
    assertEquals(50, small.at(0, 0));
    assertEquals(200, small.at(1, 0));
    assertTrue(TestImages.flat(3, 2).shrunk(256).width == 3);
  }
}
