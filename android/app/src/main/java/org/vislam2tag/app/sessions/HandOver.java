package org.vislam2tag.app.sessions;

import android.content.Context;
import android.net.ConnectivityManager;
import android.net.Network;
import android.net.NetworkCapabilities;
import java.io.File;
import java.io.IOException;
import javax.net.SocketFactory;
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

  /** The session's zip; one that was packed before is taken again, as a session that ended does not change. */
  File pack(StoredSession session, SessionZip.Progress progress) throws IOException {
    File zip = new File(SessionZipProvider.folder(context), session.folder.getName() + ".zip");
    if (!zip.isFile()) {
      SessionZip.pack(session.folder, zip, progress);
    }
    return zip;
  }

  /** Sends a zip; returns where the computer filed it. */
  String send(File zip, Receiver to, Upload.Progress progress) throws UploadException, IOException, InterruptedException {
    return new Upload(to, wifiSockets()).send(zip, progress);
  }

  /** The computer is on the local network: mobile data, which Android may prefer, does not reach it. */
  private SocketFactory wifiSockets() {
    ConnectivityManager networks = (ConnectivityManager) context.getSystemService(Context.CONNECTIVITY_SERVICE);
    for (Network network : networks.getAllNetworks()) {
      NetworkCapabilities can = networks.getNetworkCapabilities(network);
      if (can != null && (can.hasTransport(NetworkCapabilities.TRANSPORT_WIFI) || can.hasTransport(NetworkCapabilities.TRANSPORT_ETHERNET))) {
        return network.getSocketFactory();
      }
    }
    return SocketFactory.getDefault();
  }
}
