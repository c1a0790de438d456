package org.vislam2tag.core.record;

/** One access point as one entry of a scan's list tells of it. */
public final class WifiReading {
  /** When it was heard, microseconds since boot. */
  public final long timestampUs;
  public final String bssid;
  /** May be empty (hidden) or null. */
  public final String ssid;
  public final int rssiDbm;
  /** Primary channel, MHz. */
  public final int frequencyMhz;
  /** 20 to 320; 0 where it is not known. */
  public final int channelWidthMhz;
  /** Centres, MHz; 0 where there is none. */
  public final int center0Mhz;
  public final int center1Mhz;

  public WifiReading(long timestampUs, String bssid, String ssid, int rssiDbm, int frequencyMhz, int channelWidthMhz,
      int center0Mhz, int center1Mhz) {
    this.timestampUs = timestampUs;
    this.bssid = bssid;
    this.ssid = ssid;
    this.rssiDbm = rssiDbm;
    this.frequencyMhz = frequencyMhz;
    this.channelWidthMhz = channelWidthMhz;
    this.center0Mhz = center0Mhz;
    this.center1Mhz = center1Mhz;
  }

  /** The fields as the platform gave them, the width in MHz. */
  public Object[] told() {
    return new Object[] {timestampUs, bssid, ssid, rssiDbm, frequencyMhz, channelWidthMhz, center0Mhz, center1Mhz};
  }

  /** MHz of Android's {@code ScanResult.channelWidth}: 20, 40, 80, 160, 80 + 80, 320; 0 for any other. */
  public static int widthMhz(int androidChannelWidth) {
    int[] widths = {20, 40, 80, 160, 160, 320};
    return androidChannelWidth >= 0 && androidChannelWidth < widths.length ? widths[androidChannelWidth] : 0;
  }
}
