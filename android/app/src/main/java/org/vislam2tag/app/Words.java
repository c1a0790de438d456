package org.vislam2tag.app;

/** Where sentences come from: {@code Context.getString} in the app. */
public interface Words {
  /** The sentence of this resource with its parts filled in. */
  String of(int id, Object... parts);
}
