package org.vislam2tag.core.handover;

import java.net.InetAddress;
import java.net.URI;
import java.net.URISyntaxException;
import java.net.UnknownHostException;
import java.util.List;
import java.util.Locale;
import java.util.regex.Pattern;

/** A computer that takes sessions: where it listens, and the token that it shows. */
public final class Receiver {
  private static final Pattern TOKEN = Pattern.compile("[A-Z2-7]{16}");

  /** Name or address; one of IPv6 without brackets. */
  public final String host;
  public final int port;
  final String token;

  private Receiver(String host, int port, String token) {
    this.host = host;
    this.port = port;
    this.token = token;
  }

  /**
   * From a QR code or a link: {@code http://ADDRESS:PORT/#TOKEN} or {@code vislam2tag://ADDRESS:PORT/#TOKEN}.
   *
   * @throws IllegalArgumentException if it is none
   */
  public static Receiver ofLink(String link) {
    URI uri = uri(link.trim());
    boolean known = "http".equalsIgnoreCase(uri.getScheme()) || "vislam2tag".equalsIgnoreCase(uri.getScheme());
    if (!known || uri.getHost() == null || uri.getFragment() == null) {
      throw new IllegalArgumentException("\"" + link + "\" is no link of vislam2tag receive: http://ADDRESS:PORT/#TOKEN");
    }
    return of(uri, uri.getFragment());
  }

  /**
   * From what the collector typed: {@code ADDRESS:PORT} and the token, with hyphens, blanks, small letters or not.
   *
   * @throws IllegalArgumentException if one of them is none
   */
  public static Receiver ofWords(String address, String token) {
    return of(uri("http://" + address.trim() + "/"), token);
  }

  /** The link that names it ({@link #ofLink}); whoever has it may hand sessions over. */
  String link() {
    return "http://" + address() + "/#" + token;
  }

  /** The address as people read it. */
  public String address() {
    return (host.indexOf(':') >= 0 ? "[" + host + "]" : host) + ":" + port;
  }

  /**
   * The network that leads to it: a local one that its address belongs to, else the first local one; null where there is none,
   * as on the phone's own hotspot, to which the phone's usual way leads. Mobile data, which Android prefers to a Wi-Fi without
   * internet, never does.
   */
  public <N extends PhoneNetwork> N wayFrom(List<N> networks) {
    InetAddress address = literal(host);
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
  private static InetAddress literal(String host) {
    if (host.indexOf(':') < 0 && !host.matches("[0-9.]+")) {
      return null;
    }
    try {
      return InetAddress.getByName(host);
    } catch (UnknownHostException e) {
      return null;
    }
  }

  private static Receiver of(URI uri, String token) {
    if (uri.getHost() == null || uri.getPort() <= 0 || uri.getPort() > 0xFFFF) {
      throw new IllegalArgumentException("\"" + uri.getAuthority() + "\" is no ADDRESS:PORT");
    }
    String plain = token.replaceAll("[\\s-]", "").toUpperCase(Locale.ROOT);
    if (!TOKEN.matcher(plain).matches()) {
      throw new IllegalArgumentException("the token has 16 letters and digits 2 to 7, as shown on the computer");
    }
    return new Receiver(uri.getHost().replaceAll("[\\[\\]]", ""), uri.getPort(), plain);
  }

  private static URI uri(String text) {
    try {
      return new URI(text);
    } catch (URISyntaxException e) {
      throw new IllegalArgumentException("\"" + text + "\" is no address: " + e.getReason(), e);
    }
  }
}
