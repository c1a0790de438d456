package org.vislam2tag.core.walk;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;

import java.util.Collections;
import java.util.Random;
import org.junit.Test;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.record.TrackingState;

public class StretchTest {
  private static final int WALKS = 4000;
  private static final int STEPS = 300;

  /** Random walks of position and heading over this way; the error across it at its end, or in the middle once tied at the end. */
  private static double simulatedM(double metres, boolean between) {
    Random random = new Random(3);
    double step = metres / STEPS;
    double sum = 0;
    for (int n = 0; n < WALKS; n++) {
      double[] across = new double[STEPS + 1];
      double heading = 0;
      for (int i = 1; i <= STEPS; i++) {
        heading += Stretch.HEADING * Math.sqrt(step) * random.nextGaussian();
        across[i] = across[i - 1] + heading * step + Stretch.POSITION * Math.sqrt(step) * random.nextGaussian();
      }
      double error = between ? across[STEPS / 2] - across[STEPS] / 2 : across[STEPS];
      sum += error * error;
    }
    double sighting = Stretch.SIGHTING_M * Stretch.SIGHTING_M * (between ? 0.5 : 1);
    return Math.sqrt(sum / WALKS + sighting);
  }

  @Test public void theErrorBetweenTwoLandmarksIsThatOfSimulatedWalksTurnedAndShiftedOntoBoth() {
    for (double metres : new double[] {20, 60, 200}) {
      assertEquals(simulatedM(metres, true), new Stretch(metres, "a", "b").sigmaM(), 0.03 * metres / 20);
    }
  }

  @Test public void beyondTheLastOneItGrowsFaster() {
    for (double metres : new double[] {20, 60, 200}) {
      assertEquals(simulatedM(metres, false), new Stretch(metres, "a", null).sigmaM(), 0.03 * metres / 20);
      assertTrue(new Stretch(metres, null, "a").sigmaM() > new Stretch(metres, "a", "b").sigmaM());
    }
    assertEquals(Double.POSITIVE_INFINITY, new Stretch(1, null, null).sigmaM(), 0);
  }

  @Test public void theWorstOneOfAWalkIsNamedByItsLandmarks() {
    LandmarkCount count = new LandmarkCount(0);
    assertNull(count.worst(5).from);
    see(count, 1, 10, "1");
    see(count, 2, 90, "2");
    see(count, 3, 100, "3");
    Stretch worst = count.worst(101);
    assertEquals("1 2 80.0", worst.from + " " + worst.to + " " + worst.metres);
    worst = count.worst(160); // not tied at its end, it is worse though shorter
    assertEquals("3 null 60.0", worst.from + " " + worst.to + " " + worst.metres);
  }

  private static void see(LandmarkCount count, long timeNs, double walkedM, String id) {
    Pose pose = new Pose(0, 0, 0, 0, 0, 0, 1);
    count.at(timeNs, walkedM, Collections.singletonList(new TrackedImage(id, TrackingState.TRACKING, TrackedImage.SEEN_NOW, pose, 0, 0)));
  }
}
