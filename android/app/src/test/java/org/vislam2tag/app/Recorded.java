package org.vislam2tag.app;

import java.io.File;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.util.List;
import java.util.stream.Collectors;
import org.vislam2tag.app.recording.PhoneClocks;
import org.vislam2tag.core.radio.Radio;
import org.vislam2tag.core.session.Recorder;
import org.vislam2tag.core.session.RecorderListener;
import org.vislam2tag.core.session.RecorderSettings;
import org.vislam2tag.core.session.SessionDescription;
import org.vislam2tag.core.session.SessionEnd;
import org.vislam2tag.core.table.FileSink;
import org.vislam2tag.core.walk.Warning;

/** A real recorder in a folder of the test, and what it wrote. */
public final class Recorded {
  private static final RecorderListener NOBODY = new RecorderListener() {
    @Override public void warning(Warning warning) {}

    @Override public void caught(String landmark) {}

    @Override public void scansStopped(Radio radio) {}

    @Override public void ended(SessionEnd end) {}
  };

  public final Recorder recorder;

  public Recorded(File folder) throws IOException {
    recorder = Recorder.start(new Recorder.Setup(new PhoneClocks(), RecorderSettings.usual(), NOBODY, FileSink::new, null),
        new SessionDescription.Builder().build(), folder);
  }

  /** The rows of a table once the recording has ended, without the time in front. */
  public List<String> rows(String table) throws IOException {
    recorder.stop();
    return Files.readAllLines(new File(recorder.folder(), table).toPath(), StandardCharsets.UTF_8).stream().skip(1)
        .map(line -> line.substring(line.indexOf(',') + 1)).collect(Collectors.toList());
  }

  /** Events but those of start and stop. */
  public List<String> events() throws IOException {
    return rows("Events.csv").stream().filter(row -> !row.startsWith("started") && !row.startsWith("stopped"))
        .collect(Collectors.toList());
  }
}
