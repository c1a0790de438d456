package org.vislam2tag.tools;

import java.io.File;
import java.io.IOException;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import javax.net.SocketFactory;
import org.vislam2tag.core.handover.Outbox;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.SendAll;
import org.vislam2tag.core.handover.Upload;
import org.vislam2tag.core.handover.UploadException;

/** Hands zips of sessions over as the app does: {@code UploadMain LINK OUTBOX ZIP...}; without zips what waits in the outbox. */
public final class UploadMain {
  private UploadMain() {}

  /** Prints where the computer filed each session; ends with 1 and the reason where it did not. */
  public static void main(String[] arguments) throws InterruptedException {
    if (arguments.length < 2) {
      System.err.println("usage: UploadMain LINK OUTBOX ZIP...");
      System.exit(2);
    }
    List<String> zips = Arrays.asList(arguments).subList(2, arguments.length);
    try {
      Outbox outbox = new Outbox(new File(arguments[1]));
      outbox.send(Receiver.ofLink(arguments[0]), zips);
      List<String> sent = new ArrayList<>(outbox.waiting());
      new SendAll(outbox, (to, zip) -> new Upload(to, SocketFactory.getDefault()).send(new File(zip), (bytes, of) -> true)).run();
      System.exit(told(outbox, sent));
    } catch (UploadException e) {
      System.err.println(e.reason + ": " + e.getMessage());
      System.exit(1);
    } catch (IOException | IllegalArgumentException e) {
      System.err.println(e.getMessage());
      System.exit(1);
    }
  }

  private static int told(Outbox outbox, List<String> sent) {
    int refused = 0;
    for (String zip : sent) {
      if (outbox.filedAt(zip) == null) {
        System.err.println("REFUSED: " + outbox.refusal(zip));
        refused = 1;
      } else {
        System.out.println(outbox.filedAt(zip));
      }
    }
    return refused;
  }
}
