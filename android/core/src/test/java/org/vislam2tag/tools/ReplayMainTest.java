package org.vislam2tag.tools;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertTrue;
import static org.junit.Assert.fail;

import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import org.junit.Rule;
import org.junit.Test;
import org.junit.rules.TemporaryFolder;

public class ReplayMainTest {
  private static final String START = "# a walk\nset\tfloor\t4\nset\tdevice\tLG\nset\tzone\tEurope/Berlin\nset\tnote\ta\\tb\\\\\n"
      + "sensor_on\tACC\tLSM6DSO\tSTMicro\t200\nsensor_on\tMAG\tAK\tAKM\t\n"
      + "clock\t84210000000000\t61110000000000\t1640003123417\nstart\t84210000000000\n";
  private static final String FRAME = "frame\t84210371200456\t84210333500123\tTRACKING\tNONE\t0.012\t-0.003\t0.101\t0.01\t0.02\t0.0\t0.99975\n";
  private static final String ANCHOR = "anchor\t0\tTRACKING\t0.012\t-0.003\t0.101\t0.01\t0.02\t0.0\t0.99975\n";
  private static final String STOP = "stop\t84220000000000\n";

  @Rule public final TemporaryFolder temporary = new TemporaryFolder();

  private ScriptPlayer play(String text) throws IOException {
    File script = temporary.newFile();
    Files.write(script.toPath(), text.getBytes(StandardCharsets.UTF_8));
    return ReplayMain.play(script, temporary.newFolder());
  }

  private static String read(ScriptPlayer player, String name) throws IOException {
    return new String(Files.readAllBytes(new File(player.folder(), name).toPath()), StandardCharsets.UTF_8);
  }

  private void wrong(String message, String text) throws IOException {
    try {
      play(text);
      fail("played: " + text);
    } catch (ScriptException e) {
      assertEquals(message, e.getMessage());
    }
  }

  @Test public void aScriptBecomesASession() throws IOException {
    ScriptPlayer player = play(START
        + "sensor\t84210001000000\tACC\t84210000500000\t3\t0.12\t9.78\t0.35\n" + FRAME
        + "image\t12\tTRACKING\tFULL_TRACKING\t1.52\t0.31\t-2.204\t0.5\t-0.5\t-0.5\t0.5\t0.2\t0\n" + ANCHOR
        + "throttling\t84211000000000\ton\nscan_refused\t84211000000000\n"
        + "scan\t84211100000000\tupdated\nreading\t84211002345\t02:11:22:33:44:55\teduroam, \\n\t-61\t5180\t80\t5210\t\n"
        + "ble\t84211200000000\t84211190000000\tAA:BB\t\t-70\t\t76\t0215000102030405060708090a0b0c0d0e0f00010002c5\n"
        + "ble\t84211200000000\t84211190000000\tAA:BB\tx\t-70\t-4\t\t\n"
        + "range\t84211200000000\t84211150\tAA:BB:00:00:00:01\tother\t-120\t310\t-61\t8\t5\n"
        + "press\t84212000000000\ntap\t84212050000000\t3.5\t-2\t0.6\nundo\t84212060000000\nundo\t84212100000000\ncamera\t84213000000000\tunavailable\tphone_call\n"
        + "camera\t84214000000000\tavailable\npart\t84214000000000\nscan_accepted\t84214000000000\nscreen\t84214000000000\toff\n" + STOP);
    assertEquals(ScriptPlayer.Ending.STOPPED, player.ending());
    assertTrue(new File(player.folder() + ".zip").isFile());
    assertTrue(read(player, "CameraPose.csv").endsWith("\n84210333500123,84210371200456,84210333500123,61110371200456,boot,0,"
        + "TRACKING,NONE,0.012,-0.003,0.101,0.01,0.02,0.0,0.99975\n"));
    assertTrue(read(player, "LandmarkPose.csv").endsWith("\n84210333500123,12,TRACKING,FULL_TRACKING,1.52,0.31,-2.204,0.5,-0.5,-0.5,"
        + "0.5,0.2,\n"));
    assertTrue(read(player, "WiFi.csv").endsWith("\n84211002345000,0,02:11:22:33:44:55,\"eduroam, \uFFFD\",-61,5180,80,5210,,"
        + "84211100000000,fresh,on\n"));
    assertTrue(read(player, "Ble.csv").endsWith("\n84211190000000,aa:bb,,-70,,00010203-0405-0607-0809-0a0b0c0d0e0f,1,2\n"
        + "84211190000000,aa:bb,x,-70,-4,,,\n"));
    assertTrue(read(player, "Rtt.csv").endsWith("\n84211150000000,aa:bb:00:00:00:01,0,-0.12,0.31,-61,8,5\n"));
    assertTrue(read(player, "ControlPoint.csv").endsWith("\n84212000000000,0,press,,,\n84212050000000,1,tap,3.5,-2.0,0.6\n"
        + "84212060000000,1,undo,,,\n84212100000000,0,undo,,,\n"));
    assertTrue(read(player, "session.json").contains("\"note\": \"a\\u0009b\\\\\""));
  }

  @Test public void aKilledAppLeavesTheSessionOpen() throws IOException {
    ScriptPlayer player = play(START + "press\t84211000000000\nkill\t84211000000001\n");
    assertEquals(ScriptPlayer.Ending.KILLED, player.ending());
    assertTrue(read(player, "ControlPoint.csv").endsWith("84211000000000,0,press,,,\n"));
    assertTrue(read(player, "session.json").contains("\"end\": null"));
  }

  @Test public void aWrongScriptIsSaidWithItsLine() throws IOException {
    wrong("line 1: jump: unknown word", "jump\t1\n");
    wrong("line 1: press: before start", "press\t1\n");
    wrong("line 10: press: the boot clock never falls", START + "press\t84209999999999\n");
    wrong("line 10: press: \"x\" is no whole number", START + "press\tx\n");
    wrong("line 10: press: field 1 is missing", START + "press\n");
    wrong("line 10: press: more fields than expected", START + "press\t84210000000000\t7\n");
    wrong("line 10: reading: belongs to no frame or scan", START + "reading\t1\ta\tb\t-1\t2\t3\t4\t5\n");
    wrong("line 10: scan: \"maybe\" is neither \"updated\" nor \"stale\"", START + "scan\t84210000000000\tmaybe\n");
    wrong("line 10: sensor: \"LIGHT\" is no SensorKind", START + "sensor\t84210000000000\tLIGHT\t1\t3\t1\n");
    wrong("line 11: press: after the end", START + STOP + "press\t84220000000000\n");
    wrong("line 9: the script ends without stop or kill", START);
    wrong("line 10: event: event \"Bad\": small letters, digits, '_'", START + "event\t84210000000000\tBad\t\n");
  }

  @Test public void anchorsMustBeThoseThatTheCoreSet() throws IOException {
    wrong("line 10: frame: anchor 0 is asked for, and the frame does not have it", START + FRAME + STOP);
    wrong("line 10: frame: anchor 1 was never set", START + FRAME + ANCHOR + ANCHOR.replace("\t0\tT", "\t1\tT") + STOP);
  }
}
