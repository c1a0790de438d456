package org.vislam2tag.tools;

import java.io.File;
import java.io.IOException;
import javax.net.SocketFactory;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.Upload;
import org.vislam2tag.core.handover.UploadException;

/** Hands a session's zip over as the app does: {@code UploadMain LINK ZIP}. */
public final class UploadMain {
  private UploadMain() {}

  /** Prints where the computer filed the session; ends with 1 and the reason where it did not. */
  public static void main(String[] arguments) throws InterruptedException {
    if (arguments.length != 2) {
      System.err.println("usage: UploadMain LINK ZIP");
      System.exit(2);
    }
    try {
      Upload upload = new Upload(Receiver.ofLink(arguments[0]), SocketFactory.getDefault());
      System.out.println(upload.send(new File(arguments[1]), (bytes, ofBytes) -> true));
    } catch (UploadException e) {
      System.err.println(e.reason + ": " + e.getMessage());
      System.exit(1);
    } catch (IOException | IllegalArgumentException e) {
      System.err.println(e.getMessage());
      System.exit(1);
    }
  }
}
