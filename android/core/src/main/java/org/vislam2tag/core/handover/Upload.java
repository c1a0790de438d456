package org.vislam2tag.core.handover;

import java.io.File;
import java.io.IOException;
import java.io.OutputStream;
import java.io.RandomAccessFile;
import javax.net.SocketFactory;
import org.vislam2tag.core.handover.UploadException.Cause;

/**
 * Hands the zip of a session over to {@code vislam2tag receive}. It resumes where an earlier try was broken off, by itself
 * and after a restart of either side (docs/reference/phone-handover.md).
 */
public final class Upload {
  /** Bytes of a request; the computer takes 8 MiB at most. */
  static final int CHUNK = 4 << 20;
  /** So many requests in a row may fail or bring nothing. */
  static final int TRIES = 6;
  static final String ANSWERED_BY_ANOTHER = "the answer is not from the computer that shows this token";
  private static final int BUFFER = 1 << 16;
  private static final long RETRY_MS = 1_000;
  private static final long LONGEST_WAIT_S = 60;

  /** Is told how far it is; answers false to stop. */
  public interface Progress {
    boolean sent(long bytes, long ofBytes);
  }

  /** Waits; a test does not. */
  interface Pause {
    void milliseconds(long time) throws InterruptedException;
  }

  /** The collector stopped; no IOException, which would be tried again. */
  private static final class Stopped extends RuntimeException {
    private static final long serialVersionUID = 1;
  }

  private final Receiver receiver;
  private final SocketFactory sockets;
  private final Pause pause;

  /** Through {@code sockets}: those of the Wi-Fi, where the phone has mobile data too. */
  public Upload(Receiver receiver, SocketFactory sockets) {
    this(receiver, sockets, Thread::sleep);
  }

  Upload(Receiver receiver, SocketFactory sockets, Pause pause) {
    this.receiver = receiver;
    this.sockets = sockets;
    this.pause = pause;
  }

  /**
   * Sends what the computer does not have yet; returns where it filed the session, as {@code floor_4/LG/2021-12-20T132523}.
   *
   * @throws UploadException if it ends without the session filed
   * @throws IOException if the zip cannot be read
   */
  public String send(File zip, Progress progress) throws UploadException, IOException, InterruptedException {
    String path = "/v2/uploads/" + Sha256.of(zip);
    try (RandomAccessFile file = new RandomAccessFile(zip, "r")) {
      return send(path, file, progress);
    } catch (Stopped e) {
      throw new UploadException(Cause.CANCELLED, "stopped");
    }
  }

  private String send(String path, RandomAccessFile file, Progress progress)
      throws UploadException, IOException, InterruptedException {
    long length = file.length();
    long most = -1;
    UploadState state = null;
    for (int failures = 0; failures < TRIES; failures++) {
      HttpRequest request = state == null ? ask(path) : chunk(path, file, state.received, progress);
      HttpAnswer answer = answer(request);
      state = answer == null ? null : stateOf(request, answer);
      if (state == null) {
        pause.milliseconds(answer == null ? RETRY_MS : waitMs(answer));
      } else if (state.filed) {
        progress.sent(length, length);
        return state.session;
      } else if (state.received < 0 || state.received > length) {
        throw new UploadException(Cause.NOT_UNDERSTOOD, "the computer has " + state.received + " bytes of " + length);
      } else if (state.received > most) {
        most = state.received;
        failures = -1;
      }
    }
    throw new UploadException(Cause.NO_CONNECTION, "no connection to " + receiver.address());
  }

  /** Null where the connection fails. */
  private HttpAnswer answer(HttpRequest request) {
    try {
      return request.send(sockets);
    } catch (IOException e) {
      return null;
    }
  }

  private HttpRequest ask(String path) {
    return new HttpRequest(receiver, "GET", path);
  }

  private HttpRequest chunk(String path, RandomAccessFile file, long from, Progress progress) throws IOException {
    long length = Math.min(CHUNK, file.length() - from);
    return new HttpRequest(receiver, "PATCH", path).body(from, length, file.length(), Sha256.of(file, from, length),
        out -> copy(file, from, length, out, progress));
  }

  private static void copy(RandomAccessFile file, long from, long length, OutputStream out, Progress progress)
      throws IOException {
    byte[] buffer = new byte[BUFFER];
    file.seek(from);
    for (long done = 0; done < length; ) {
      int n = (int) Math.min(buffer.length, length - done);
      file.readFully(buffer, 0, n);
      out.write(buffer, 0, n);
      done += n;
      if (!progress.sent(from + done, file.length())) {
        throw new Stopped();
      }
    }
  }

  /** The state that an answer tells; null where it says to wait. */
  private static UploadState stateOf(HttpRequest request, HttpAnswer answer) throws UploadException {
    switch (answer.status) {
      case 200:
      case 409:
        if (!request.isAnsweredBy(answer)) {
          throw new UploadException(Cause.NOT_UNDERSTOOD, ANSWERED_BY_ANOTHER);
        }
        return understood(answer);
      case 423:
      case 429:
        return null;
      default:
        throw refusal(answer);
    }
  }

  /** What an answer other than 200 means that asking again does not change. */
  static UploadException refusal(HttpAnswer answer) {
    switch (answer.status) {
      case 404:
        return new UploadException(Cause.NOT_UNDERSTOOD, "the computer's program is older than this app: update it");
      case 401:
        return new UploadException(Cause.WRONG_TOKEN, UploadState.message(answer));
      case 413:
        return new UploadException(Cause.TOO_LARGE, UploadState.message(answer));
      case 422:
        return new UploadException(Cause.REFUSED, UploadState.message(answer));
      case 507:
        return new UploadException(Cause.COMPUTER_FULL, UploadState.message(answer));
      default:
        return new UploadException(Cause.NOT_UNDERSTOOD, UploadState.message(answer));
    }
  }

  private static UploadState understood(HttpAnswer answer) throws UploadException {
    try {
      return UploadState.of(answer);
    } catch (IOException e) {
      throw new UploadException(Cause.NOT_UNDERSTOOD, e.getMessage());
    }
  }

  private static long waitMs(HttpAnswer answer) {
    return Math.min(answer.number("retry-after", 1), LONGEST_WAIT_S) * 1_000;
  }
}
