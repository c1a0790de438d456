package org.vislam2tag.core.clock;

import java.time.Instant;
import java.time.OffsetDateTime;
import java.time.ZoneId;
import java.time.format.DateTimeFormatter;
import java.util.Locale;

/** Wall times as text, the same in every locale (no Arabic digits, no Buddhist years). */
public final class WallTime {
  private static final DateTimeFormatter ISO = DateTimeFormatter.ofPattern("uuuu-MM-dd'T'HH:mm:ss.SSSxxx", Locale.ROOT);
  private static final DateTimeFormatter NAME = DateTimeFormatter.ofPattern("uuuu-MM-dd'T'HHmmss", Locale.ROOT);

  private WallTime() {}

  /** As in session.json: {@code 2021-12-20T13:25:23.417+01:00}. */
  public static String iso(long wallMs, ZoneId zone) {
    return ISO.format(at(wallMs, zone));
  }

  /** As in the name of a session's folder: {@code 2021-12-20T132523}. */
  public static String folderName(long wallMs, ZoneId zone) {
    return NAME.format(at(wallMs, zone));
  }

  private static OffsetDateTime at(long wallMs, ZoneId zone) {
    return Instant.ofEpochMilli(wallMs).atZone(zone).toOffsetDateTime();
  }
}
