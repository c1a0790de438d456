package org.vislam2tag.core.clock;

import java.time.ZoneId;

/** Where the core gets the time from: the phone's clocks in the app, a script's in tests. */
public interface Clocks {
  /** All three clocks, read as closely together as can be. */
  ClockReading read();

  /** The zone that wall times are shown in and sessions are named in. */
  ZoneId zone();
}
