package org.vislam2tag.core.session;

import java.io.BufferedWriter;
import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.time.ZoneId;
import org.vislam2tag.core.clock.ClockReading;
import org.vislam2tag.core.record.Pose;
import org.vislam2tag.core.record.TrackedFrame;
import org.vislam2tag.core.record.TrackedImage;
import org.vislam2tag.core.tracking.AnchorHost;

/**
 * Writes all that the platform tells a recorder as a script (docs/reference/phone-format.md), so that a real walk becomes a
 * test. For developers: unlike tables it is written at the call, and lost from the first failure of the disk on.
 */
final class ScriptLog {
  /** Clocks that moved against each other by more than this have a line of their own, ns. */
  private static final long MOVED_NS = 1_000_000;
  private static final long MS = 1_000_000;

  private BufferedWriter out;
  private ClockReading told;
  private long lastNs;

  /** Begins a script in this file. */
  ScriptLog(File file) {
    try {
      out = Files.newBufferedWriter(file.toPath(), StandardCharsets.UTF_8);
    } catch (IOException e) {
      out = null; // the session itself goes on
    }
  }

  /** What is known before the start. */
  void begin(SessionDescription description, ClockReading start, ZoneId zone) {
    description.script(this);
    line("set", "zone", zone.getId());
    clock(start);
    line("start", start.bootNs);
  }

  /** A call at this time. */
  void call(ClockReading now, String word, Object... fields) {
    if (Math.abs(now.bootNs - now.nanoNs - (told.bootNs - told.nanoNs)) > MOVED_NS
        || Math.abs(now.bootNs - now.wallMs * MS - (told.bootNs - told.wallMs * MS)) > MOVED_NS) {
      clock(now);
    }
    lastNs = Math.max(lastNs, now.bootNs); // a frame's clocks are read before the recorder is free for it
    Object[] all = new Object[fields.length + 1];
    all[0] = lastNs;
    System.arraycopy(fields, 0, all, 1, fields.length);
    line(word, all);
  }

  /** A frame with its images; its anchors are those that {@link #telling} is asked for. */
  void frame(TrackedFrame frame) {
    Pose pose = frame.pose;
    call(frame.arrival, "frame", frame.frameNs, frame.state, frame.failure, pose.txM, pose.tyM, pose.tzM, pose.qx, pose.qy, pose.qz,
        pose.qw);
    for (TrackedImage image : frame.images) {
      pose = image.pose;
      line("image", image.id, image.state, image.method, pose.txM, pose.tyM, pose.tzM, pose.qx, pose.qy, pose.qz, pose.qw,
          image.extentXM, image.extentZM);
    }
  }

  /** The same anchors, told as they are asked for. */
  AnchorHost telling(AnchorHost host) {
    return new AnchorHost() {
      @Override public boolean set(int number, Pose pose) {
        return host.set(number, pose);
      }

      @Override public State get(int number) {
        State state = host.get(number);
        Pose pose = state.pose;
        line("anchor", number, state.state, pose.txM, pose.tyM, pose.tzM, pose.qx, pose.qy, pose.qz, pose.qw);
        return state;
      }

      @Override public void detach(int number) {
        host.detach(number);
      }
    };
  }

  /** A line of a word and its fields; null and what is no number are empty. */
  void line(String word, Object... fields) {
    StringBuilder line = new StringBuilder(word);
    for (Object field : fields) {
      boolean missing = field == null || field instanceof Float && !Float.isFinite((Float) field);
      line.append('\t').append(missing ? "" : escaped(field.toString()));
    }
    try {
      if (out != null) {
        out.append(line).append('\n');
      }
    } catch (IOException e) {
      out = null; // a script without its end is refused when it is played
    }
  }

  /** The last line; whatever came of it, the session ends. */
  void end(ClockReading now) {
    call(now, "stop");
    try {
      if (out != null) {
        out.close();
      }
    } catch (IOException e) {
      out = null;
    }
  }

  private void clock(ClockReading now) {
    told = now;
    line("clock", now.bootNs, now.nanoNs, now.wallMs);
  }

  private static String escaped(String text) {
    return text.replace("\\", "\\\\").replace("\t", "\\t").replace("\n", "\\n").replace("\r", "\\r");
  }
}
