package org.vislam2tag.app.sessions;

import android.content.Context;
import android.net.ConnectivityManager;
import java.io.File;
import java.io.IOException;
import java.nio.file.Files;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.SessionZip;
import org.vislam2tag.core.handover.Upload;
import org.vislam2tag.core.handover.UploadException;
import org.vislam2tag.core.session.StoredSession;

/** Packs sessions and sends them. Not for the main thread. */
final class HandOver {
  private final Context context;

  HandOver(Context context) {
    this.context = context;
  }

  /** The session's zip; one that was packed before is taken again where the session is not newer. */
  File pack(StoredSession session, SessionZip.Progress progress) throws IOException {
    File zip = new File(SessionZipProvider.folder(context), session.folder.getName() + ".zip");
    if (!isCurrent(zip, session.folder)) {
      SessionZip.pack(session.folder, zip, progress);
    }
    return zip;
  }

  /** Deletes the zip of a session that is deleted. */
  void forget(StoredSession session) throws IOException {
    Files.deleteIfExists(new File(SessionZipProvider.folder(context), session.folder.getName() + ".zip").toPath());
  }

  /** A session that was killed is finished later, and changes once more by that. */
  static boolean isCurrent(File zip, File session) {
    long packed = zip.lastModified(); // 0 where there is none
    for (File file : session.listFiles()) {
      if (file.lastModified() >= packed) {
        return false;
      }
    }
    return true;
  }

  /** Sends a zip; returns where the computer filed it. */
  String send(File zip, Receiver to, Upload.Progress progress) throws UploadException, IOException, InterruptedException {
    ConnectivityManager networks = (ConnectivityManager) context.getSystemService(Context.CONNECTIVITY_SERVICE);
    try (ComputerNetwork network = new ComputerNetwork(networks, ComputerNetwork.JOINING_MS)) {
      return new Upload(to, network.sockets(to)).send(zip, progress);
    }
  }
}
