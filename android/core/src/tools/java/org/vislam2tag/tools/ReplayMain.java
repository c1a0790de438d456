package org.vislam2tag.tools;

import java.io.BufferedReader;
import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import org.vislam2tag.core.handover.SessionZip;

/**
 * Writes a session with the app's own recorder from a script of what a phone saw: {@code ReplayMain SCRIPT FOLDER}
 * (docs/reference/phone-format.md).
 */
public final class ReplayMain {
  private ReplayMain() {}

  /** Prints the session's folder; ends with 1 and a message where the script is wrong. */
  public static void main(String[] arguments) {
    if (arguments.length != 2) {
      System.err.println("usage: ReplayMain SCRIPT FOLDER");
      System.exit(2);
    }
    try {
      ScriptPlayer player = play(new File(arguments[0]), new File(arguments[1]));
      System.out.println(player.folder());
      if (player.ending() == ScriptPlayer.Ending.KILLED) {
        System.out.flush();
        Runtime.getRuntime().halt(0);
      }
    } catch (ScriptException | IOException e) {
      System.err.println(arguments[0] + ": " + e.getMessage());
      System.exit(1);
    }
  }

  /** Plays the script into a new session in {@code folder}, and packs it unless the script kills the app. */
  static ScriptPlayer play(File script, File folder) throws IOException {
    ScriptPlayer player = new ScriptPlayer(folder);
    int number = 0;
    try (BufferedReader lines = Files.newBufferedReader(script.toPath(), StandardCharsets.UTF_8)) {
      for (String line = lines.readLine(); line != null; line = lines.readLine()) {
        number++;
        if (!line.isEmpty() && !line.startsWith("#")) {
          player.play(new ScriptLine(number, line));
        }
      }
    }
    if (player.ending() == null) {
      throw new ScriptException(number, "the script ends without stop or kill");
    }
    if (player.ending() == ScriptPlayer.Ending.STOPPED) {
      SessionZip.pack(player.folder(), new File(player.folder().getPath() + ".zip"), (bytes, ofBytes) -> {});
    }
    return player;
  }
}
