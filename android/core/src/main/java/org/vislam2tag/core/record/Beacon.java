package org.vislam2tag.core.record;

import java.util.Locale;

/** Identity of an iBeacon, from the manufacturer's part of an advertisement. */
public final class Beacon {
  /** Company number under which iBeacons advertise. */
  public static final int COMPANY = 0x004C;
  private static final int TYPE = 0x02;
  private static final int LENGTH = 0x15;
  private static final int UUID_AT = 2;
  private static final int MAJOR_AT = 18;
  private static final int MINOR_AT = 20;
  private static final int BYTES = 23;

  /** Lower case, with hyphens. */
  public final String uuid;
  /** 0 to 65535. */
  public final int major;
  public final int minor;

  private Beacon(String uuid, int major, int minor) {
    this.uuid = uuid;
    this.major = major;
    this.minor = minor;
  }

  /** The beacon that this manufacturer's data is of; null where it is none. */
  public static Beacon of(int company, byte[] data) {
    if (company != COMPANY || data == null || data.length < BYTES || data[0] != TYPE || data[1] != LENGTH) {
      return null;
    }
    return new Beacon(uuid(data), unsigned(data, MAJOR_AT), unsigned(data, MINOR_AT));
  }

  /** The manufacturer's data that it is told by, as hexadecimal digits; the power at one metre is not known any more. */
  String hex() {
    return String.format(Locale.ROOT, "%02x%02x%s%04x%04x00", TYPE, LENGTH, uuid.replace("-", ""), major, minor);
  }

  private static String uuid(byte[] data) {
    StringBuilder text = new StringBuilder(36);
    for (int i = UUID_AT; i < MAJOR_AT; i++) {
      int n = i - UUID_AT;
      if (n == 4 || n == 6 || n == 8 || n == 10) {
        text.append('-');
      }
      text.append(Character.forDigit(data[i] >> 4 & 0xF, 16)).append(Character.forDigit(data[i] & 0xF, 16));
    }
    return text.toString();
  }

  private static int unsigned(byte[] data, int at) {
    return (data[at] & 0xFF) << 8 | data[at + 1] & 0xFF;
  }
}
