package android.sysprop;

import java.util.Optional;

/** Developer options of the screen: all off. */
public final class DisplayProperties {
  private DisplayProperties() {}

  public static Optional<Boolean> debug_force_rtl() {
    return Optional.empty();
  }

  public static Optional<Boolean> debug_layout() {
    return Optional.empty();
  }
}
