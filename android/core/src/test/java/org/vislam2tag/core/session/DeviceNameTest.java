package org.vislam2tag.core.session;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;

import java.util.Collections;
import org.junit.Test;

public class DeviceNameTest {
  private static final String LONG = String.join("", Collections.nCopies(70, "a"));

  @Test public void namesAreGoodForFoldersEverywhere() {
    for (String good : new String[] {"LG", "SM-A528B", "One Plus 6", "a", "7.1_x", LONG.substring(0, 64)}) {
      assertTrue(good, DeviceName.isGood(good));
    }
    for (String bad : new String[] {"marker_dict.csv", "floorplan.PNG", "tachymeter", "", " a", "a ", "a.", ".a", "a/b", "..", "ä", "a\n", LONG.substring(0, 65)}) {
      assertFalse(bad, DeviceName.isGood(bad));
    }
  }

  @Test public void aNameIsMadeOfAnyModel() {
    String[][] models = {{"LM-G900", "LM-G900"}, {"..ä/b?. ", "b_"}, {"", "phone"}, {"小米", "phone"}, {"x.csv", "phone"}, {LONG, LONG.substring(0, 64)}};
    for (String[] model : models) {
      assertEquals(model[1], DeviceName.proposedFrom(model[0]));
      assertTrue(DeviceName.isGood(DeviceName.proposedFrom(model[0])));
    }
  }
}
