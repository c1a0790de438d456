package org.vislam2tag.app.sessions;

import android.net.ConnectivityManager;
import android.net.LinkAddress;
import android.net.LinkProperties;
import android.net.Network;
import android.net.NetworkCapabilities;
import android.net.NetworkRequest;
import java.io.Closeable;
import java.util.ArrayList;
import java.util.List;
import java.util.concurrent.CountDownLatch;
import java.util.concurrent.TimeUnit;
import javax.net.SocketFactory;
import org.vislam2tag.core.handover.PhoneNetwork;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.Subnet;

/** The way to the computer. While it is open Android keeps a Wi-Fi that leads nowhere else, and does not leave it for another. */
public final class ComputerNetwork extends ConnectivityManager.NetworkCallback implements Closeable {
  /** A phone joins a Wi-Fi that it knows in about so long. */
  public static final long JOINING_MS = 3000;

  private final ConnectivityManager networks;
  private final long waitMs;
  private final CountDownLatch available = new CountDownLatch(1);

  /** Asks Android for the Wi-Fi, with internet or not; one that is being joined is waited for so long. */
  public ComputerNetwork(ConnectivityManager networks, long waitMs) {
    this.networks = networks;
    this.waitMs = waitMs;
    NetworkRequest.Builder wifi = new NetworkRequest.Builder();
    wifi.addTransportType(NetworkCapabilities.TRANSPORT_WIFI);
    wifi.removeCapability(NetworkCapabilities.NET_CAPABILITY_INTERNET);
    networks.requestNetwork(wifi.build(), this);
  }

  @Override public void onAvailable(Network network) {
    available.countDown();
  }

  /** Where connections to the computer are made from. Waits for a Wi-Fi where the phone is on none: not for the main thread. */
  public SocketFactory sockets(Receiver receiver) throws InterruptedException {
    Candidate found = receiver.wayFrom(candidates());
    if (found == null && available.await(waitMs, TimeUnit.MILLISECONDS)) {
      found = receiver.wayFrom(candidates());
    }
    return found == null ? SocketFactory.getDefault() : found.network.getSocketFactory();
  }

  @Override public void close() {
    networks.unregisterNetworkCallback(this);
  }

  private List<Candidate> candidates() {
    List<Candidate> found = new ArrayList<>();
    for (Network network : networks.getAllNetworks()) {
      NetworkCapabilities can = networks.getNetworkCapabilities(network);
      LinkProperties link = networks.getLinkProperties(network);
      if (can != null && link != null) { // null for one that has just gone
        found.add(new Candidate(network, can, link));
      }
    }
    return found;
  }

  private static final class Candidate implements PhoneNetwork {
    final Network network;
    private final NetworkCapabilities can;
    private final List<Subnet> subnets = new ArrayList<>();

    Candidate(Network network, NetworkCapabilities can, LinkProperties link) {
      this.network = network;
      this.can = can;
      for (LinkAddress own : link.getLinkAddresses()) {
        subnets.add(new Subnet(own.getAddress(), own.getPrefixLength()));
      }
    }

    @Override public boolean isLocal() {
      return can.hasCapability(NetworkCapabilities.NET_CAPABILITY_NOT_VPN)
          && (can.hasTransport(NetworkCapabilities.TRANSPORT_WIFI) || can.hasTransport(NetworkCapabilities.TRANSPORT_ETHERNET));
    }

    @Override public List<Subnet> subnets() {
      return subnets;
    }
  }
}
