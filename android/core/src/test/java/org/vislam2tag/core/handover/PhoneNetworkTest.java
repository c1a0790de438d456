package org.vislam2tag.core.handover;

import static org.junit.Assert.assertEquals;
import static org.junit.Assert.assertFalse;
import static org.junit.Assert.assertTrue;

import java.net.InetAddress;
import java.util.Arrays;
import java.util.Collections;
import java.util.List;
import org.junit.Test;

public class PhoneNetworkTest {
  private static PhoneNetwork network(boolean local, String own, int prefixBits) throws Exception {
    List<Subnet> subnets = Collections.singletonList(new Subnet(InetAddress.getByName(own), prefixBits));
    return new PhoneNetwork() {
      @Override public boolean isLocal() {
        return local;
      }

      @Override public List<Subnet> subnets() {
        return subnets;
      }
    };
  }

  private static Receiver computer(String host) {
    return Receiver.ofWords(host + ":8765", "ABCDEFGHIJKL2345");
  }

  @Test public void aSubnetHoldsWhatBeginsAsItsOwnAddress() throws Exception {
    Subnet home = new Subnet(InetAddress.getByName("192.168.179.20"), 23);
    assertTrue(home.holds(InetAddress.getByName("192.168.178.1")));
    assertFalse(home.holds(InetAddress.getByName("192.168.180.1")));
    assertFalse(home.holds(InetAddress.getByName("fe80::1")));
    assertTrue(new Subnet(InetAddress.getByName("10.0.0.1"), 0).holds(InetAddress.getByName("8.8.8.8")));
    assertFalse(new Subnet(InetAddress.getByName("10.0.0.1"), 32).holds(InetAddress.getByName("10.0.0.2")));
  }

  @Test public void theNetworkThatHoldsTheComputerIsTaken() throws Exception {
    PhoneNetwork mobile = network(false, "192.168.1.3", 24);
    PhoneNetwork other = network(true, "10.0.0.5", 8);
    PhoneNetwork right = network(true, "192.168.1.7", 24);
    List<PhoneNetwork> all = Arrays.asList(mobile, other, right);
    assertEquals(right, computer("192.168.1.20").wayFrom(all));
    assertEquals(other, computer("laptop.local").wayFrom(all)); // a name tells no network
    assertEquals(other, computer("172.16.0.1").wayFrom(all)); // behind a router
    assertEquals(null, computer("192.168.1.20").wayFrom(Collections.singletonList(mobile)));
  }

  @Test public void anAddressOfIpv6IsOneToo() throws Exception {
    PhoneNetwork six = network(true, "fe80::7", 64);
    assertEquals(six, computer("[fe80::1]").wayFrom(Arrays.asList(network(true, "10.0.0.5", 8), six)));
  }
}
