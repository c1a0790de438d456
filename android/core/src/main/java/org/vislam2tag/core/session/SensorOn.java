package org.vislam2tag.core.session;

import java.util.LinkedHashMap;
import java.util.Map;
import org.vislam2tag.core.record.SensorKind;

/** A sensor that is switched on for a session. */
public final class SensorOn {
  /** The rate of a sensor that is to send as fast as it can. */
  public static final double FASTEST = Double.NaN;

  private final SensorKind kind;
  private final String name;
  private final String vendor;
  private final double rateHz;

  /** With the rate asked for, Hz, or {@link #FASTEST}. */
  public SensorOn(SensorKind kind, String name, String vendor, double rateHz) {
    this.kind = kind;
    this.name = name;
    this.vendor = vendor;
    this.rateHz = rateHz;
  }

  void script(ScriptLog script) {
    script.line("sensor_on", kind, name, vendor, Double.isNaN(rateHz) ? null : rateHz);
  }

  Map<String, Object> json() {
    Map<String, Object> json = new LinkedHashMap<>();
    json.put("sensor", kind.name());
    json.put("name", name);
    json.put("vendor", vendor);
    json.put("rate_hz", rateHz);
    return json;
  }
}
