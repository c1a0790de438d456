package org.vislam2tag.core.landmarks;

import java.io.ByteArrayOutputStream;
import java.io.IOException;
import java.io.InputStream;
import java.nio.charset.StandardCharsets;
import java.util.ArrayList;
import java.util.List;

/** The list of images that {@code vislam2tag sheets} writes: {@code id,file,width_m}; columns are taken by name. */
final class Manifest {
  static final String FILE = "manifest.csv";
  private static final int MOST_BYTES = 4 << 20;
  /** A print is no wider, m. */
  private static final float WIDEST_M = 10;

  private final List<Landmark> landmarks = new ArrayList<>();
  private final List<Refusal> refusals = new ArrayList<>();

  private Manifest() {}

  /**
   * Reads a manifest.
   *
   * @throws IOException if it cannot be read or lacks a column
   */
  static Manifest read(InputStream in) throws IOException {
    List<List<String>> rows = CsvText.rows(text(in));
    List<String> header = rows.isEmpty() ? new ArrayList<>() : rows.get(0);
    int id = column(header, "id");
    int file = column(header, "file");
    int width = column(header, "width_m");
    Manifest manifest = new Manifest();
    for (int i = 1; i < rows.size(); i++) {
      List<String> row = rows.get(i);
      manifest.line(i, field(row, id), field(row, file), field(row, width));
    }
    return manifest;
  }

  /** The lines that can be used, in their order. */
  List<Landmark> landmarks() {
    return landmarks;
  }

  /** The lines that cannot. */
  List<Refusal> refusals() {
    return refusals;
  }

  private void line(int number, String id, String file, String width) {
    String name = id.isEmpty() ? "row " + number : id;
    if (id.isEmpty() || file.isEmpty()) {
      refusals.add(new Refusal(name, Refusal.Reason.BAD_LINE, "id or file is empty"));
    } else if (file.indexOf('/') >= 0 || file.indexOf('\\') >= 0 || file.startsWith(".")) {
      refusals.add(new Refusal(name, Refusal.Reason.BAD_LINE, "file \"" + file + "\" is not in the folder itself"));
    } else if (!isWidth(width)) {
      refusals.add(new Refusal(name, Refusal.Reason.BAD_LINE, "width_m \"" + width + "\" is no width in metres"));
    } else {
      landmarks.add(new Landmark(id, file, Float.parseFloat(width)));
    }
  }

  private static boolean isWidth(String text) {
    try {
      float width = Float.parseFloat(text);
      return width > 0 && width <= WIDEST_M;
    } catch (NumberFormatException e) {
      return false;
    }
  }

  private static String field(List<String> row, int column) {
    return column < row.size() ? row.get(column) : "";
  }

  private static int column(List<String> header, String name) throws IOException {
    int column = header.indexOf(name);
    if (column < 0) {
      throw new IOException(FILE + " has no column \"" + name + "\" (id,file,width_m)");
    }
    return column;
  }

  private static String text(InputStream in) throws IOException {
    ByteArrayOutputStream bytes = new ByteArrayOutputStream();
    byte[] buffer = new byte[1 << 14];
    for (int n = in.read(buffer); n >= 0; n = in.read(buffer)) {
      bytes.write(buffer, 0, n);
      if (bytes.size() > MOST_BYTES) {
        throw new IOException(FILE + " is longer than " + MOST_BYTES + " bytes");
      }
    }
    return new String(bytes.toByteArray(), StandardCharsets.UTF_8);
  }
}
