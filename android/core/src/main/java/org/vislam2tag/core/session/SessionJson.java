package org.vislam2tag.core.session;

import java.time.ZoneId;
import java.util.LinkedHashMap;
import java.util.Map;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.clock.WallTime;

/** The contents of session.json, at the start and at the end of a session. */
final class SessionJson {
  private SessionJson() {}

  /** With {@code end} null, as long as the session is being recorded. */
  static Map<String, Object> started(String session, SessionDescription description, ClockReading start, ZoneId zone) {
    Map<String, Object> json = description.json(session);
    json.put("start", clocks(start, zone));
    json.put("end", null);
    description.addEquipment(json);
    return json;
  }

  /** The same session, ended; {@code now} is null where the clocks at the end are not known. */
  static void end(Map<String, Object> json, SessionEnd how, ClockReading now, ZoneId zone) {
    Map<String, Object> end = new LinkedHashMap<>();
    end.put("state", how.state.word());
    end.put("detail", how.detail);
    end.putAll(clocks(now, zone));
    json.put("end", end);
  }

  private static Map<String, Object> clocks(ClockReading reading, ZoneId zone) {
    Map<String, Object> json = new LinkedHashMap<>();
    json.put("wall", reading == null ? null : WallTime.iso(reading.wallMs, zone));
    json.put("wall_ms", reading == null ? null : reading.wallMs);
    json.put("boot_ns", reading == null ? null : reading.bootNs);
    json.put("nano_ns", reading == null ? null : reading.nanoNs);
    return json;
  }
}
