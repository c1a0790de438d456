package org.vislam2tag.core.radio;

/**
 * Notices that a radio brings nothing any more while the screen is off, though something was asked for: battery savers of
 * some phones end scans then (mjaakko/NeoStumbler on GitHub, issue 195).
 */
public final class SilenceWatch {
  /** Three times the pace of scans on a phone that throttles them, ns. */
  static final long SILENT_NS = 3 * ScanPacer.WINDOW_NS / ScanPacer.ALLOWED;

  private boolean screenOff;
  private boolean expecting;
  private boolean silent;
  private long sinceNs;
  private long silentNs;

  /** The screen went on or off. */
  public void screen(boolean on, long nowNs) {
    if (!on && !screenOff && !silent) {
      sinceNs = nowNs; // what was before had other causes
    }
    screenOff = !on;
  }

  /** Something was asked for, and an answer is expected. */
  public void expect() {
    expecting = true;
  }

  /** Something was heard; tells for how long nothing was, s, where that was noticed, else 0. */
  public double heard(long nowNs) {
    double seconds = silent ? (nowNs - sinceNs) / 1e9 : 0;
    silentNs += silent ? nowNs - sinceNs : 0;
    silent = false;
    expecting = false;
    sinceNs = nowNs;
    return seconds;
  }

  /** Looks again: true when it has just been silent for too long. */
  public boolean fellSilent(long nowNs) {
    boolean now = screenOff && expecting && nowNs - sinceNs >= SILENT_NS;
    boolean news = now && !silent;
    silent |= now;
    return news;
  }

  /** In all, s. */
  public double silentS(long nowNs) {
    return (silentNs + (silent ? nowNs - sinceNs : 0)) / 1e9;
  }
}
