package android.os;

import java.util.HashMap;
import java.util.Map;

/** The properties of a phone that was set up by a test; Android's own defaults otherwise. */
public final class SystemPropertiesNatives {
  private static final Map<String, String> SET = new HashMap<>();

  static {
    SET.put("ro.build.version.sdk", "29");
    SET.put("ro.build.version.codename", "REL");
    SET.put("ro.build.version.release", "10");
    SET.put("ro.build.version.all_codenames", "REL");
    SET.put("ro.product.cpu.abilist", "arm64-v8a");
    SET.put("ro.product.cpu.abilist64", "arm64-v8a");
    SET.put("ro.product.manufacturer", "Maker");
    SET.put("ro.product.model", "Phone 1");
  }

  private SystemPropertiesNatives() {}

  static String native_get(String key) {
    return native_get(key, "");
  }

  static String native_get(String key, String otherwise) {
    return SET.getOrDefault(key, otherwise);
  }

  static int native_get_int(String key, int otherwise) {
    return SET.containsKey(key) ? Integer.parseInt(SET.get(key)) : otherwise;
  }

  static long native_get_long(String key, long otherwise) {
    return SET.containsKey(key) ? Long.parseLong(SET.get(key)) : otherwise;
  }

  static boolean native_get_boolean(String key, boolean otherwise) {
    return otherwise;
  }
}
