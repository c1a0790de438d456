package org.vislam2tag.core.session;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertNull;
import static org.junit.Assert.assertTrue;

import java.io.BufferedReader;
import java.io.File;
import java.io.InputStreamReader;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.ArrayList;
import java.util.Collections;
import java.util.List;
import java.util.Map;
import java.util.Random;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;
import org.vislam2tag.core.table.Table;

/** Kills a process that records, in the way that Android does (SIGKILL), at moments that nobody chose. */
public class KillTest {
  private static final int KILLS = 4;
  /** A row is on disk a second after it was told; two more for a machine that has other work. */
  private static final long LATEST_NS = 3_000_000_000L;

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();

  /** Lines that the process printed: number of a press, and when. */
  private final List<long[]> told = new ArrayList<>();

  private void recordAndKill(File sessions, long afterMs) throws Exception {
    String java = System.getProperty("java.home") + "/bin/java";
    Process process = new ProcessBuilder(java, "-Xshare:auto", "-cp", System.getProperty("java.class.path"),
        KilledMain.class.getName(), sessions.getPath()).redirectErrorStream(true).start();
    told.clear();
    try (BufferedReader out = new BufferedReader(new InputStreamReader(process.getInputStream(), StandardCharsets.UTF_8))) {
      long killNs = Long.MAX_VALUE;
      for (String line = out.readLine(); line != null && System.nanoTime() < killNs; line = out.readLine()) {
        killNs = killNs == Long.MAX_VALUE ? System.nanoTime() + afterMs * 1_000_000 : killNs;
        String[] words = line.split(" ");
        assertTrue(line, words[0].matches("[0-9]+"));
        told.add(new long[] {Long.parseLong(words[0]), Long.parseLong(words[1])});
      }
      process.destroyForcibly();
    }
    assertEquals("killed by SIGKILL", 137, process.waitFor());
  }

  @Test public void theNextStartSaysThatItWasKilledAndLeavesWholeRows() throws Exception {
    Random random = new Random(1);
    for (int kill = 0; kill < KILLS; kill++) {
      File sessions = temporary.newFolder();
      recordAndKill(sessions, kill == 0 ? 4_500 : random.nextInt(1500));
      SessionStore store = new SessionStore(sessions);
      File folder = store.list(null).get(0).folder;
      assertNull(SessionFiles.readJson(folder).get("end"));
      assertEquals(Collections.singletonList(folder), store.recover(null));
      int presses = rows(folder, Table.PRESSES);
      for (Table table : Table.values()) {
        rows(folder, table);
      }
      assertTrue(presses + " rows, " + toldInTime() + " were told in time", presses >= toldInTime());
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

  /** Presses that were told long enough before the end. */
  private long toldInTime() {
    long last = told.get(told.size() - 1)[1];
    long number = 0;
    for (long[] press : told) {
      number = press[1] < last - LATEST_NS ? press[0] : number;
    }
    return number;
  }
}
