package org.vislam2tag.core.json;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.fail;

import java.io.IOException;
import java.util.Arrays;
import java.util.Collections;
import java.util.LinkedHashMap;
import java.util.Locale;
import java.util.Map;
import org.junit.Test;

public class JsonTest {
  private static final String[] BROKEN = {"", "{", "{\"a\"}", "{\"a\":1,}", "[1,]", "[1 2]", "\"a", "\"\\x\"", "\"\\u12\"",
      "tru", "1x", "-", "1.2.3", "{} {}", "nul", "[", "99999999999999999999"};

  @Test public void whatIsWrittenIsReadAgain() throws IOException {
    Map<String, Object> map = new LinkedHashMap<>();
    map.put("text", "a\"b\\c\nd\u0001 \u00e4 \uD83D\uDE00");
    map.put("long", 9_007_199_254_740_993L);
    map.put("double", 0.1);
    map.put("list", Arrays.asList(1L, true, null, Collections.emptyMap(), Collections.emptyList()));
    assertEquals(map, JsonReader.readObject(JsonWriter.write(map)));
  }

  @Test public void numbersHaveAPointAndNoNeedlessOne() {
    Locale usual = Locale.getDefault();
    Locale.setDefault(Locale.GERMANY);
    try {
      assertEquals("[\n  200,\n  0.5,\n  null\n]\n", JsonWriter.write(Arrays.asList(200.0, 0.5, Double.NaN)));
    } finally {
      Locale.setDefault(usual);
    }
  }

  @Test public void halvesOfCharactersAreReplaced() {
    assertEquals("\"\uFFFDa\uFFFD\"\n", JsonWriter.write("\uDE00a\uD83D"));
  }

  @Test public void whatOthersWriteIsReadToo() throws IOException {
    assertEquals("\u00e9/\t", JsonReader.read(" \"\\u00e9\\/\\t\" "));
    assertEquals(-1.5e3, JsonReader.read("-1.5E3"));
  }

  @Test public void whatIsNoJsonIsAnError() {
    for (String text : BROKEN) {
      try {
        JsonReader.read(text);
        fail(text);
      } catch (IOException expected) {
        continue;
      }
    }
  }

  @Test public void deepNestingIsAnErrorAndNoCrash() {
    char[] deep = new char[100_000];
    Arrays.fill(deep, '[');
    try {
      JsonReader.read(new String(deep));
      fail("read");
    } catch (IOException expected) {
      assertEquals("JSON: less nesting expected at character 32", expected.getMessage());
    }
  }
}
