package org.vislam2tag.app.sessions;

import org.vislam2tag.core.handover.Receiver;

/** The computer that the collector means: a whole link in the first field, or address and token in two. */
final class Receivers {
  private Receivers() {}

  static Receiver of(String addressOrLink, String token) {
    return addressOrLink.contains("#") ? Receiver.ofLink(addressOrLink) : Receiver.ofWords(addressOrLink, token);
  }
}
