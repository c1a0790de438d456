package org.vislam2tag.core.table;

import java.io.File;
import java.io.IOException;
import java.io.RandomAccessFile;

/** A sink that is a file. No FileChannel: an interrupt of the writing thread would close that. */
public final class FileSink implements RowSink {
  private final RandomAccessFile file;

  public FileSink(File path) throws IOException {
    file = new RandomAccessFile(path, "rw");
    file.seek(file.length());
  }

  @Override public void write(byte[] bytes, int length) throws IOException {
    file.write(bytes, 0, length);
  }

  @Override public long size() throws IOException {
    return file.length();
  }

  @Override public void truncate(long size) throws IOException {
    file.setLength(size);
  }

  @Override public void force() throws IOException {
    file.getFD().sync();
  }

  @Override public void close() throws IOException {
    file.close();
  }
}
