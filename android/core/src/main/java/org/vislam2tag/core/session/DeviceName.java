package org.vislam2tag.core.session;

import java.util.regex.Pattern;

/** The name of a device's folder in a survey. */
public final class DeviceName {
  private static final int MOST = 64;
  private static final Pattern GOOD = Pattern.compile("[A-Za-z0-9]([A-Za-z0-9._ -]{0,62}[A-Za-z0-9_-])?");
  /** A floor's own files and folders: a device's folder of that name would stand in their place. */
  private static final Pattern TAKEN = Pattern.compile("(?i)tachymeter|.*\\.(csv|jpe?g|png)");

  private DeviceName() {}

  /** Can a folder have this name on every computer? */
  public static boolean isGood(String name) {
    return GOOD.matcher(name).matches() && !TAKEN.matcher(name).matches();
  }

  /** A good name like this phone's model. */
  public static String proposedFrom(String model) {
    String name = model.replaceAll("[^A-Za-z0-9._ -]", "_").replaceAll("^[^A-Za-z0-9]+", "");
    name = name.substring(0, Math.min(name.length(), MOST)).replaceAll("[ .]+$", "");
    return isGood(name) ? name : "phone";
  }

  static String checked(String name) {
    if (!isGood(name)) {
      throw new IllegalArgumentException("device \"" + name + "\": letters, digits, '.', '_', '-' and blanks, at most "
          + MOST + ", beginning with a letter or digit, not ending with a blank or a dot, no name of a floor's own file");
    }
    return name;
  }
}
