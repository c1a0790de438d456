package libcore.io;

import java.io.FileDescriptor;
import java.io.IOException;
import java.nio.charset.StandardCharsets;
import java.nio.file.Files;
import java.nio.file.Paths;

/** Files, with the JVM's own means. */
public final class IoUtils {
  private IoUtils() {}

  public static void closeQuietly(AutoCloseable closeable) {
    try {
      if (closeable != null) {
        closeable.close();
      }
    } catch (Exception e) {
      return; // as its name says
    }
  }

  public static void closeQuietly(FileDescriptor file) {}

  public static void setFdOwner(FileDescriptor file, Object owner) {}

  public static String readFileAsString(String path) throws IOException {
    return new String(Files.readAllBytes(Paths.get(path)), StandardCharsets.UTF_8);
  }
}
