package org.vislam2tag.app;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNotEquals;
import static org.junit.Assert.assertTrue;

import java.io.File;
import java.util.Arrays;
import java.util.HashSet;
import java.util.Map;
import java.util.Set;
import java.util.TreeMap;
import java.util.TreeSet;
import java.util.regex.Matcher;
import java.util.regex.Pattern;
import javax.xml.parsers.DocumentBuilderFactory;
import org.junit.Test;
import org.w3c.dom.Element;
import org.w3c.dom.NodeList;

/** Both languages say the same. */
public class StringsTest {
  private static final Pattern PART = Pattern.compile("%(?:[0-9]+\\$)?[^a-zA-Z%]*[a-zA-Z]");
  private static final Set<String> SAME = new HashSet<>(Arrays.asList("app_name", "start", "token_hint", "session_size"));

  @Test public void everySentenceIsThereInBothWithTheSameParts() throws Exception {
    Map<String, String> english = strings("values");
    Map<String, String> german = strings("values-de");
    assertTrue(english.size() > 50);
    assertEquals(english.keySet(), german.keySet());
    for (String key : english.keySet()) {
      assertEquals(key, parts(english.get(key)), parts(german.get(key)));
    }
  }

  @Test public void nothingIsLeftUntranslated() throws Exception {
    Map<String, String> german = strings("values-de");
    for (Map.Entry<String, String> sentence : strings("values").entrySet()) {
      if (!SAME.contains(sentence.getKey())) {
        assertNotEquals(sentence.getKey(), sentence.getValue(), german.get(sentence.getKey()));
      }
    }
  }

  private static Set<String> parts(String sentence) {
    Set<String> parts = new TreeSet<>();
    for (Matcher matcher = PART.matcher(sentence.replace("%%", "")); matcher.find();) {
      parts.add(matcher.group());
    }
    return parts;
  }

  private static Map<String, String> strings(String language) throws Exception {
    File here = new File("src/main/res"); // Gradle runs tests in the module's folder, build.sh in the one above
    File file = new File(here.isDirectory() ? here : new File("app/src/main/res"), language + "/strings.xml");
    NodeList nodes = DocumentBuilderFactory.newInstance().newDocumentBuilder().parse(file).getElementsByTagName("string");
    Map<String, String> found = new TreeMap<>();
    for (int i = 0; i < nodes.getLength(); i++) {
      Element node = (Element) nodes.item(i);
      found.put(node.getAttribute("name"), node.getTextContent());
    }
    return found;
  }
}
