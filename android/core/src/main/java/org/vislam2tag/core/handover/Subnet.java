package org.vislam2tag.core.handover;

import java.net.InetAddress;

/** The addresses that a network reaches without a router: those that begin as the phone's own in it does. */
public final class Subnet {
  private final byte[] own;
  private final int prefixBits;

  /** Of the phone's address, and so many bits of it as all have in common. */
  public Subnet(InetAddress own, int prefixBits) {
    this.own = own.getAddress();
    this.prefixBits = prefixBits;
  }

  /** Does the address belong to it? */
  boolean holds(InetAddress address) {
    byte[] other = address.getAddress();
    if (other.length != own.length) {
      return false;
    }
    for (int bit = 0; bit < prefixBits; bit++) {
      if (((own[bit / 8] ^ other[bit / 8]) >> (7 - bit % 8) & 1) != 0) {
        return false;
      }
    }
    return true;
  }
}
