package org.vislam2tag.core.handover;

import java.io.IOException;
import java.util.Map;
import java.util.TreeMap;
import javax.net.SocketFactory;
import org.vislam2tag.core.handover.UploadException.Cause;
import org.vislam2tag.core.site.Site;
import org.vislam2tag.core.site.SiteFloor;
import org.vislam2tag.core.site.SiteStore;

/** Takes the building's name, floors and plans from the computer that sessions will be handed over to. */
public final class SiteDownload {
  private final Receiver receiver;
  private final SocketFactory sockets;

  public SiteDownload(Receiver receiver, SocketFactory sockets) {
    this.receiver = receiver;
    this.sockets = sockets;
  }

  /**
   * Takes all of it, and keeps it in place of what was kept before. A plan that the computer cannot draw lacks.
   *
   * @throws UploadException if the computer does not answer as it should; nothing is changed then
   * @throws IOException if it cannot be kept
   */
  public Site into(SiteStore store) throws UploadException, IOException {
    HttpAnswer told = ask("/v2/survey");
    if (told.status != 200) {
      throw Upload.refusal(told);
    }
    Site site;
    try {
      site = Site.of(told.body);
    } catch (IOException e) {
      throw new UploadException(Cause.NOT_UNDERSTOOD, e.getMessage());
    }
    Map<Integer, byte[]> plans = new TreeMap<>();
    for (SiteFloor floor : site.floors) {
      HttpAnswer plan = floor.hasPlan ? ask("/v2/plans/" + floor.number) : null;
      if (plan != null && plan.status == 200) {
        plans.put(floor.number, plan.bytes);
      }
    }
    store.keep(told.body, plans);
    return site;
  }

  private HttpAnswer ask(String path) throws UploadException {
    HttpRequest request = new HttpRequest(receiver, "GET", path);
    HttpAnswer answer;
    try {
      answer = request.send(sockets);
    } catch (IOException e) {
      throw new UploadException(Cause.NO_CONNECTION, "no connection to " + receiver.address());
    }
    if (answer.status == 200 && !request.isAnsweredBy(answer)) {
      throw new UploadException(Cause.NOT_UNDERSTOOD, Upload.ANSWERED_BY_ANOTHER);
    }
    return answer;
  }
}
