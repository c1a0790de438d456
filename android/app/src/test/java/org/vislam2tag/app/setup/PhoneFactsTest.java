package org.vislam2tag.app.setup;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;

import java.util.Arrays;
import java.util.Collections;
import java.util.HashSet;
import java.util.Set;
import org.junit.Test;

public class PhoneFactsTest {
  @Test public void aWalkWithoutCameraSaysSoFromTheStart() {
    PhoneFacts facts = new PhoneFacts();
    facts.cameraAllowed = false;
    assertEquals(Arrays.asList("without_camera", "no_camera_permission"), facts.events(true));
    assertEquals(Collections.singletonList("no_camera_permission"), facts.events(false));
  }

  @Test public void aGoodPhoneHasNoProblem() {
    PhoneFacts facts = new PhoneFacts();
    facts.landmarks = 12;
    assertEquals(Collections.emptyList(), facts.problems());
  }

  @Test public void eachFaultHasItsSentenceInOrderOfWeight() {
    PhoneFacts facts = new PhoneFacts();
    facts.arCore = PhoneFacts.ArCore.UNSUPPORTED;
    facts.cameraAllowed = facts.locationAllowed = facts.bluetoothAllowed = false;
    facts.locationOn = facts.wifiOn = facts.bluetoothOn = false;
    facts.scansThrottled = true;
    facts.missingSensors = Arrays.asList("PRESSURE", "MAG_UN");
    facts.refusedLandmarks = Collections.singletonList("7");
    facts.freeBytes = 100L << 20;
    Set<Problem> all = new HashSet<>(Arrays.asList(Problem.values()));
    all.remove(Problem.ARCORE_NEEDS_INSTALL);
    assertEquals(all, new HashSet<>(facts.problems()));
    assertEquals(Problem.NO_ARCORE, facts.problems().get(0));
    assertEquals("PRESSURE, MAG_UN", facts.names(Problem.SENSORS_MISSING));
    assertEquals("7", facts.names(Problem.LANDMARKS_REFUSED));
    assertEquals("100", facts.names(Problem.STORAGE_LOW));
  }

  @Test public void anInstallableTrackerIsAnotherProblemThanNone() {
    PhoneFacts facts = new PhoneFacts();
    facts.landmarks = 1;
    facts.arCore = PhoneFacts.ArCore.NEEDS_INSTALL;
    assertEquals(Collections.singletonList(Problem.ARCORE_NEEDS_INSTALL), facts.problems());
  }

  @Test public void sentencesDiffer() {
    Set<Integer> sentences = new HashSet<>();
    for (Problem problem : Problem.values()) {
      assertTrue(problem.name(), sentences.add(problem.sentence));
    }
  }

  @Test public void whatLeavesAWalkWithoutAPlaceIsAskedAbout() {
    PhoneFacts facts = new PhoneFacts();
    facts.landmarks = 3;
    facts.wifiOn = false;
    assertFalse(facts.problems().stream().anyMatch(Problem::isAskedAbout));
    facts.cameraAllowed = false;
    assertTrue(facts.problems().stream().anyMatch(Problem::isAskedAbout));
    facts.cameraAllowed = true;
    facts.landmarks = 0;
    assertTrue(facts.problems().stream().anyMatch(Problem::isAskedAbout));
  }
}
