package org.vislam2tag.core.handover;

import java.net.InetAddress;
import java.net.UnknownHostException;
import java.util.List;

/** A network that the phone is on, as far as the way to a computer beside it goes. */
public interface PhoneNetwork {
  /** Is it Wi-Fi or a cable, and no tunnel through one? */
  boolean isLocal();

  /** What it reaches without a router. */
  List<Subnet> subnets();

  /**
   * The network that leads to a computer: a local one that the computer's address belongs to, else the first local one; null
   * where there is none, as on the phone's own hotspot, to which the phone's usual way leads. Mobile data, which Android
   * prefers to a Wi-Fi without internet, never does.
   */
  static <N extends PhoneNetwork> N towards(Receiver receiver, List<N> networks) {
    InetAddress address = literal(receiver.host);
    N first = null;
    for (N network : networks) {
      if (!network.isLocal()) {
        continue;
      }
      if (address != null && network.subnets().stream().anyMatch(subnet -> subnet.holds(address))) {
        return network;
      }
      first = first == null ? network : first;
    }
    return first;
  }

  /** The address that a text is; null where it is a name, which is not looked up. */
  static InetAddress literal(String host) {
    if (host.indexOf(':') < 0 && !host.matches("[0-9.]+")) {
      return null;
    }
    try {
      return InetAddress.getByName(host);
    } catch (UnknownHostException e) {
      return null;
    }
  }
}
