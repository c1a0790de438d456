package org.vislam2tag.core.session;

import java.io.File;
import java.io.IOException;
import java.time.ZoneId;
import java.util.Map;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.table.RowSink;

/** The files of a session being recorded, from the making of its folder to the last word in session.json. */
final class OpenSession {
  /** Between two times of forcing rows to storage, ns. */
  private static final long FORCE_NS = 10_000_000_000L;

  private final File folder;
  private final ZoneId zone;
  private final FreeSpace space;
  private final SpaceReserve reserve;
  private final Map<String, Object> json;
  private final SessionTables tables;
  private long forcedNs;

  /** Makes all files, with their headers; throws an IOException where that fails, and leaves nothing then. */
  OpenSession(File sessions, SessionDescription description, ClockReading start, ZoneId zone, RowSink.Opener opener,
      FreeSpace space) throws IOException {
    this.zone = zone;
    this.space = space;
    folder = SessionFiles.create(sessions, start.wallMs, zone);
    reserve = new SpaceReserve(sessions);
    json = SessionJson.started(folder.getName(), description, start, zone);
    try {
      SessionFiles.writeJson(folder, json);
      tables = new SessionTables(folder, opener);
    } catch (IOException e) {
      reserve.release();
      SessionFiles.delete(folder);
      throw e;
    }
    forcedNs = start.bootNs;
  }

  File folder() {
    return folder;
  }

  SessionTables tables() {
    return tables;
  }

  /** Hands all rows over, and forces them to storage now and then; null, or how the session has to end. */
  SessionEnd write(long nowNs) {
    try {
      tables.flush();
      if (nowNs - forcedNs >= FORCE_NS) {
        forcedNs = nowNs;
        tables.force();
      }
      return null;
    } catch (SessionTables.WriteFailure e) {
      reserve.release();
      return failure(e);
    }
  }

  /** Closes all files and says in session.json how it ended; tells how, which a failing disk may change. */
  SessionEnd close(SessionEnd planned, ClockReading now) {
    SessionEnd end = closeTables(planned);
    reserve.release();
    SessionJson.end(json, end, now, zone);
    try {
      SessionFiles.writeJson(folder, json);
      return end;
    } catch (IOException e) {
      // The end stays null there: the session counts as killed; its tables are whole.
      return new SessionEnd(EndState.WRITE_FAILED, SessionFiles.JSON + ": " + e.getMessage());
    }
  }

  private SessionEnd closeTables(SessionEnd planned) {
    try {
      tables.close();
      return planned;
    } catch (SessionTables.WriteFailure e) {
      SessionEnd failure = failure(e);
      return planned.state == EndState.STOPPED ? failure : planned;
    }
  }

  private SessionEnd failure(SessionTables.WriteFailure failure) {
    return failure.isDiskFull() ? new SessionEnd(EndState.DISK_FULL, Long.toString(space.bytes()))
        : new SessionEnd(EndState.WRITE_FAILED, failure.getMessage());
  }
}
