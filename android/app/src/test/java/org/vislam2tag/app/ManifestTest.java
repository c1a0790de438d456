package org.vislam2tag.app;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;

import java.io.File;
import java.util.Arrays;
import java.util.HashSet;
import java.util.Set;
import javax.xml.parsers.DocumentBuilderFactory;
import org.junit.Test;
import org.w3c.dom.Document;
import org.w3c.dom.Element;
import org.w3c.dom.NodeList;

/** What Android is told of the app, where a walk depends on it. */
public class ManifestTest {
  @Test public void nothingThatChangesDuringAWalkMakesItsScreenAnew() throws Exception {
    Set<String> kept = new HashSet<>(Arrays.asList(
        named("activity", "org.vislam2tag.app.record.RecordActivity").getAttribute("android:configChanges").split("\\|")));
    assertTrue(kept.toString(), kept.containsAll(Arrays.asList("uiMode", "fontScale", "density", "keyboard", "keyboardHidden",
        "orientation", "screenSize", "smallestScreenSize", "screenLayout", "locale", "layoutDirection", "navigation")));
  }

  @Test public void phonesWithoutArCoreMayInstallTheApp() throws Exception {
    assertEquals("optional", named("meta-data", "com.google.ar.core").getAttribute("android:value"));
    assertEquals("false", named("uses-feature", "android.hardware.camera.ar").getAttribute("android:required"));
  }

  @Test public void androidAsksBeforeSessionsGoWithTheApp() throws Exception {
    Element application = (Element) manifest().getElementsByTagName("application").item(0);
    assertEquals("true", application.getAttribute("android:hasFragileUserData"));
  }

  private static Element named(String kind, String name) throws Exception {
    NodeList nodes = manifest().getElementsByTagName(kind);
    for (int i = 0; i < nodes.getLength(); i++) {
      if (name.equals(((Element) nodes.item(i)).getAttribute("android:name"))) {
        return (Element) nodes.item(i);
      }
    }
    throw new AssertionError(kind + " " + name);
  }

  private static Document manifest() throws Exception {
    File here = new File("src/main"); // Gradle runs tests in the module's folder, build.sh in the one above
    File file = new File(here.isDirectory() ? here : new File("app/src/main"), "AndroidManifest.xml");
    return DocumentBuilderFactory.newInstance().newDocumentBuilder().parse(file);
  }
}
