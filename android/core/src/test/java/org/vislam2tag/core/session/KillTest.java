package org.vislam2tag.core.session;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;

import java.io.BufferedReader;
import java.io.File;
import java.io.InputStreamReader;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.Collections;
import java.util.Map;
import java.util.Random;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.table.Table;

/** Kills a process that records, in the way that Android does (SIGKILL), at moments that nobody chose. */
public class KillTest {
  private static final int KILLS = 4;
  /** Most lines that the process prints before it is killed. */
  private static final int MOST_LINES = 100;

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();

  /** Kills it once it has printed so many lines; the number in the last of them. */
  private int recordAndKill(File sessions, int lines) throws Exception {
    String java = System.getProperty("java.home") + "/bin/java";
    Process process = new ProcessBuilder(java, "-Xshare:auto", "-cp", System.getProperty("java.class.path"),
        KilledMain.class.getName(), sessions.getPath()).redirectErrorStream(true).start();
    String last = "0";
    try (BufferedReader out = new BufferedReader(new InputStreamReader(process.getInputStream(), StandardCharsets.UTF_8))) {
      for (int i = 0; i < lines; i++) {
        last = String.valueOf(out.readLine());
        assertTrue(last, last.matches("[0-9]+"));
      }
      process.destroyForcibly();
    }
    assertEquals("killed by SIGKILL", 137, process.waitFor());
    return Integer.parseInt(last);
  }

  @Test public void theNextStartSaysThatItWasKilledAndLeavesWholeRows() throws Exception {
    Random random = new Random(1);
    for (int kill = 0; kill < KILLS; kill++) {
      File sessions = temporary.newFolder();
      int written = recordAndKill(sessions, kill == 0 ? MOST_LINES : 1 + random.nextInt(MOST_LINES));
      SessionStore store = new SessionStore(sessions);
      File folder = store.list(null).get(0).folder;
      assertNull(SessionFiles.readJson(folder).get("end"));
      assertEquals(Collections.singletonList(folder), store.recover(null));
      int presses = rows(folder, Table.PRESSES);
      for (Table table : Table.values()) {
        rows(folder, table);
      }
      assertTrue(presses + " rows, of " + written + " and more", presses > written);
      assertEquals("killed", ((Map<?, ?>) SessionFiles.readJson(folder).get("end")).get("state"));
      assertEquals(Collections.emptyList(), store.recover(null));
    }
  }

  /** How many rows a table has, each of them whole. */
  private static int rows(File folder, Table table) throws Exception {
    String text = new String(Files.readAllBytes(new File(folder, table.fileName).toPath()), StandardCharsets.UTF_8);
    assertTrue(table + " ends in the middle of a row", text.endsWith("\n"));
    String[] lines = text.split("\n");
    assertEquals(table.header, lines[0]);
    for (String line : lines) {
      assertEquals(line, fields(table.header), fields(line));
    }
    return lines.length - 1;
  }

  private static int fields(String line) {
    int commas = 0;
    boolean quoted = false;
    for (char c : line.toCharArray()) {
      quoted ^= c == '"';
      commas += c == ',' && !quoted ? 1 : 0;
    }
    return commas + 1;
  }
}
