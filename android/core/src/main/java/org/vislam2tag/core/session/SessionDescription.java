package org.vislam2tag.core.session;

import java.util.ArrayList;
import java.util.Arrays;
import java.util.Collections;
import java.util.LinkedHashMap;
import java.util.List;
import java.util.Map;

/** What is known of a session before it starts: place, people's words, phone, sensors, landmarks. */
public final class SessionDescription {
  private final String site;
  private final int floor;
  private final String device;
  private final String note;
  private final String appVersion;
  private final Map<String, Object> phone;
  private final List<SensorOn> sensors;
  private final int landmarksLoaded;
  private final List<String> landmarksRefused;

  private SessionDescription(Builder builder) {
    site = builder.site;
    floor = builder.floor;
    device = DeviceName.checked(builder.device);
    note = builder.note;
    appVersion = builder.appVersion;
    phone = new LinkedHashMap<>(builder.phone);
    sensors = new ArrayList<>(builder.sensors);
    landmarksLoaded = builder.landmarksLoaded;
    landmarksRefused = new ArrayList<>(builder.landmarksRefused);
  }

  /** The description's keys of session.json, for the session of this name. */
  Map<String, Object> json(String session) {
    Map<String, Object> json = new LinkedHashMap<>();
    json.put("format", "vislam2tag-phone");
    json.put("version", 1);
    json.put("session", session);
    json.put("site", site);
    json.put("floor", floor);
    json.put("device", device);
    json.put("note", note);
    json.put("app", Collections.singletonMap("version", appVersion));
    json.put("phone", phone);
    return json;
  }

  int floor() {
    return floor;
  }

  /** Does the tracker look for any landmark? */
  boolean hasLandmarks() {
    return landmarksLoaded > 0;
  }

  /** The lines of a script that say the same; which images were refused they do not. */
  void script(ScriptLog script) {
    script.line("set", "site", site);
    script.line("set", "floor", floor);
    script.line("set", "device", device);
    script.line("set", "note", note);
    script.line("set", "app_version", appVersion);
    phone.forEach((key, value) -> {
      if (value != null) { // ARCore is not installed
        script.line("set", key, value);
      }
    });
    script.line("set", "landmarks", landmarksLoaded);
    sensors.forEach(sensor -> sensor.script(script));
  }

  /** The keys that stand last in session.json. */
  void addEquipment(Map<String, Object> json) {
    List<Object> on = new ArrayList<>();
    for (SensorOn sensor : sensors) {
      on.add(sensor.json());
    }
    json.put("sensors", on);
    Map<String, Object> landmarks = new LinkedHashMap<>();
    landmarks.put("loaded", landmarksLoaded);
    landmarks.put("refused", landmarksRefused);
    json.put("landmarks", landmarks);
  }

  /** Collects a description; what is not said is empty, floor 0. */
  public static final class Builder {
    private String site = "";
    private int floor;
    private String device = "phone";
    private String note = "";
    private String appVersion = "";
    private final Map<String, Object> phone = new LinkedHashMap<>();
    private final List<SensorOn> sensors = new ArrayList<>();
    private int landmarksLoaded;
    private List<String> landmarksRefused = Collections.emptyList();

    public Builder() {
      phone("", "", "", 0, null);
    }

    /** Building and floor, as the collector chose them. */
    public Builder place(String siteName, int floorNumber) {
      site = siteName;
      floor = floorNumber;
      return this;
    }

    /** The device's folder in a survey ({@link DeviceName}). */
    public Builder device(String name) {
      device = name;
      return this;
    }

    /** The collector's own words. */
    public Builder note(String words) {
      note = words;
      return this;
    }

    /** Version of this app. */
    public Builder app(String version) {
      appVersion = version;
      return this;
    }

    /** The phone; {@code arcore} is null where ARCore is not installed. */
    public Builder phone(String manufacturer, String model, String android, int api, String arcore) {
      phone.put("manufacturer", manufacturer);
      phone.put("model", model);
      phone.put("android", android);
      phone.put("api", api);
      phone.put("arcore", arcore);
      return this;
    }

    /** Another sensor that is switched on. */
    public Builder sensor(SensorOn sensor) {
      sensors.add(sensor);
      return this;
    }

    /** How many landmark images the tracker took, and the ids of those refused. */
    public Builder landmarks(int loaded, String... refused) {
      landmarksLoaded = loaded;
      landmarksRefused = Arrays.asList(refused);
      return this;
    }

    /** The description.
     *
     * @throws IllegalArgumentException if the device's name is none for a folder
     */
    public SessionDescription build() {
      return new SessionDescription(this);
    }
  }
}
