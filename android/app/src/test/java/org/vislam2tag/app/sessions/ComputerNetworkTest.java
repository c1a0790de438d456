package org.vislam2tag.app.sessions;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertSame;
import static org.mockito.ArgumentMatchers.any;
import static org.mockito.Mockito.doAnswer;
import static org.mockito.Mockito.mock;
import static org.mockito.Mockito.verify;
import static org.mockito.Mockito.when;

import android.net.ConnectivityManager;
import android.net.LinkAddress;
import android.net.LinkProperties;
import android.net.Network;
import android.net.NetworkCapabilities;
import java.net.InetAddress;
import java.util.Collections;
import javax.net.SocketFactory;
import org.junit.Test;
import org.vislam2tag.core.handover.Receiver;

public class ComputerNetworkTest {
  private static final Receiver COMPUTER = Receiver.ofWords("192.168.1.20:8765", "ABCDEFGHIJKL2345");

  private final ConnectivityManager networks = mock(ConnectivityManager.class);

  private Network network(int transport, boolean tunnel, String address) throws Exception {
    Network network = mock(Network.class);
    when(network.getSocketFactory()).thenReturn(mock(SocketFactory.class));
    NetworkCapabilities can = mock(NetworkCapabilities.class);
    when(can.hasTransport(transport)).thenReturn(true);
    when(can.hasCapability(NetworkCapabilities.NET_CAPABILITY_NOT_VPN)).thenReturn(!tunnel);
    LinkAddress own = mock(LinkAddress.class);
    when(own.getAddress()).thenReturn(InetAddress.getByName(address));
    when(own.getPrefixLength()).thenReturn(24);
    LinkProperties link = mock(LinkProperties.class);
    when(link.getLinkAddresses()).thenReturn(Collections.singletonList(own));
    when(networks.getNetworkCapabilities(network)).thenReturn(can);
    when(networks.getLinkProperties(network)).thenReturn(link);
    return network;
  }

  private SocketFactory sockets() throws InterruptedException {
    try (ComputerNetwork way = new ComputerNetwork(networks, 1)) {
      return way.sockets(COMPUTER);
    } finally {
      verify(networks).unregisterNetworkCallback(any(ConnectivityManager.NetworkCallback.class));
    }
  }

  @Test public void theComputerIsReachedByItsWifiNotByMobileDataOrATunnel() throws Exception {
    Network mobile = network(NetworkCapabilities.TRANSPORT_CELLULAR, false, "192.168.1.3");
    Network tunnel = network(NetworkCapabilities.TRANSPORT_WIFI, true, "192.168.1.3");
    Network gone = mock(Network.class);
    Network wifi = network(NetworkCapabilities.TRANSPORT_WIFI, false, "192.168.1.7");
    when(networks.getAllNetworks()).thenReturn(new Network[] {mobile, tunnel, gone, wifi});
    assertSame(wifi.getSocketFactory(), sockets());
  }

  @Test public void aWifiThatIsBeingJoinedIsWaitedFor() throws Exception {
    Network wifi = network(NetworkCapabilities.TRANSPORT_WIFI, false, "192.168.1.7");
    when(networks.getAllNetworks()).thenReturn(new Network[0], new Network[] {wifi});
    doAnswer(call -> {
      call.<ConnectivityManager.NetworkCallback>getArgument(1).onAvailable(wifi);
      return null;
    }).when(networks).requestNetwork(any(), any(ConnectivityManager.NetworkCallback.class));
    assertSame(wifi.getSocketFactory(), sockets());
  }

  @Test public void withoutWifiThePhonesUsualWayIsTaken() throws Exception {
    when(networks.getAllNetworks()).thenReturn(new Network[0]);
    assertEquals(SocketFactory.getDefault().getClass(), sockets().getClass());
    verify(networks).requestNetwork(any(), any(ConnectivityManager.NetworkCallback.class));
  }
}
