package android.graphics;

import java.util.ArrayList;
import java.util.List;

/** The numbers that stand for objects behind Android's graphics. */
public final class Handles {
  private static final List<Object> OBJECTS = new ArrayList<>();

  static {
    OBJECTS.add(null);
  }

  private Handles() {}

  /** A number for an object. */
  public static synchronized long of(Object object) {
    OBJECTS.add(object);
    return OBJECTS.size() - 1L;
  }

  /** The object of a number, null of 0. */
  @SuppressWarnings("unchecked")
  public static synchronized <T> T get(long handle) {
    return (T) OBJECTS.get((int) handle);
  }
}
