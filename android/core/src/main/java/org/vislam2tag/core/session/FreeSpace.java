package org.vislam2tag.core.session;

/** How much the disk of the sessions still takes. */
public interface FreeSpace {
  /** Bytes left. */
  long bytes();
}
