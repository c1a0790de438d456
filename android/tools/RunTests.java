import java.io.File;
import java.io.IOException;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.ArrayList;
import java.util.List;
import java.util.stream.Collectors;
import java.util.stream.Stream;
import org.junit.runner.Description;
import org.junit.runner.JUnitCore;
import org.junit.runner.Result;
import org.junit.runner.notification.Failure;
import org.junit.runner.notification.RunListener;

/**
 * Runs every class named *Test below the folders given, prints "N passed, N failed" and how long the slowest took, and
 * fails when a test fails or none ran.
 */
public final class RunTests {
  private RunTests() {}

  public static void main(String[] folders) throws Exception {
    List<Class<?>> tests = new ArrayList<>();
    for (String folder : folders) {
      for (String name : testClasses(new File(folder).toPath())) {
        tests.add(Class.forName(name));
      }
    }
    JUnitCore junit = new JUnitCore();
    Slowest slowest = new Slowest();
    junit.addListener(slowest);
    Result result = junit.run(tests.toArray(new Class<?>[0]));
    for (Failure failure : result.getFailures()) {
      System.out.println("FAILED " + failure.getTestHeader() + "\n" + failure.getTrace());
    }
    System.out.println("slowest: " + slowest.name + ", " + slowest.milliseconds + " ms of " + result.getRunTime());
    System.out.println((result.getRunCount() - result.getFailureCount()) + " passed, " + result.getFailureCount() + " failed");
    System.exit(result.wasSuccessful() && result.getRunCount() > 0 ? 0 : 1);
  }

  private static List<String> testClasses(Path folder) throws IOException {
    try (Stream<Path> files = Files.walk(folder)) {
      return files.map(file -> folder.relativize(file).toString())
          .filter(name -> name.endsWith("Test.class") && !name.contains("$"))
          .map(name -> name.substring(0, name.length() - ".class".length()).replace(File.separatorChar, '.'))
          .sorted()
          .collect(Collectors.toList());
    }
  }

  private static final class Slowest extends RunListener {
    private String name = "none";
    private long milliseconds;
    private long startedNs;

    @Override public void testStarted(Description test) {
      startedNs = System.nanoTime();
    }

    @Override public void testFinished(Description test) {
      long took = (System.nanoTime() - startedNs) / 1_000_000;
      if (took > milliseconds) {
        milliseconds = took;
        name = test.getDisplayName();
      }
    }
  }
}
