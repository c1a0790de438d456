package org.vislam2tag.core.handover;

import java.util.List;

/** A network that the phone is on, as far as the way to a computer beside it goes. */
public interface PhoneNetwork {
  /** Is it Wi-Fi or a cable, and no tunnel through one? */
  boolean isLocal();

  /** What it reaches without a router. */
  List<Subnet> subnets();
}
