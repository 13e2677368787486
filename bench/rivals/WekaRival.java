// WekaRival METHOD TRAIN TEST COLUMNS THREADS: one line of JSON, see run.py. METHOD: M5P. Single-threaded.
import java.io.IOException;
import java.lang.management.ManagementFactory;
import java.nio.ByteBuffer;
import java.nio.ByteOrder;
import java.nio.DoubleBuffer;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.Locale;
import weka.classifiers.trees.M5P;
import weka.core.Attribute;
import weka.core.FastVector;
import weka.core.Instance;
import weka.core.Instances;

class WekaRival {
  static Instances load(String path, int columns) throws IOException {
    DoubleBuffer values =
        ByteBuffer.wrap(Files.readAllBytes(Path.of(path))).order(ByteOrder.LITTLE_ENDIAN).asDoubleBuffer();
    int rows = values.remaining() / columns;
    FastVector attributes = new FastVector();
    for (int j = 0; j < columns; j++) attributes.addElement(new Attribute("x" + j));
    Instances data = new Instances("data", attributes, rows);
    data.setClassIndex(columns - 1);
    for (int i = 0; i < rows; i++) {
      double[] row = new double[columns];
      for (int j = 0; j < columns; j++) row[j] = values.get(j * rows + i);
      data.add(new Instance(1.0, row));
    }
    return data;
  }

  static double peak() throws IOException {
    for (String line : Files.readAllLines(Path.of("/proc/self/status"))) {
      if (line.startsWith("VmHWM:")) return 1024.0 * Double.parseDouble(line.replaceAll("[^0-9]", ""));
    }
    return 0.0;
  }

  static double cpu() {
    return 1e-9
        * ((com.sun.management.OperatingSystemMXBean) ManagementFactory.getOperatingSystemMXBean()).getProcessCpuTime();
  }

  public static void main(String[] arguments) throws Exception {
    int columns = Integer.parseInt(arguments[3]);
    Instances train = load(arguments[1], columns);
    Instances test = load(arguments[2], columns);
    System.gc();
    Files.writeString(Path.of("/proc/self/clear_refs"), "5");
    double before = peak();
    double cpuStart = cpu();
    long start = System.nanoTime();
    M5P model = new M5P();
    model.buildClassifier(train);
    double fitWall = 1e-9 * (System.nanoTime() - start);
    double fitCpu = cpu() - cpuStart;
    double memory = peak() - before;
    double squares = 0.0;
    int runs = 0;
    cpuStart = cpu();
    start = System.nanoTime();
    for (; runs == 0 || System.nanoTime() - start < 500000000L; runs++) {
      squares = 0.0;
      for (int i = 0; i < test.numInstances(); i++) {
        double error = model.classifyInstance(test.instance(i)) - test.instance(i).classValue();
        squares += error * error;
      }
    }
    double perMillion = 1e6 / ((double) runs * test.numInstances());
    System.out.printf(Locale.ROOT,
        "{\"fit_wall\": %g, \"fit_cpu\": %g, \"predict_wall\": %g, \"predict_cpu\": %g, \"memory\": %g, "
            + "\"rmse\": %.10g, \"leaves\": %d, \"version\": \"%s\"}%n",
        fitWall, fitCpu, 1e-9 * (System.nanoTime() - start) * perMillion, (cpu() - cpuStart) * perMillion, memory,
        Math.sqrt(squares / test.numInstances()), (int) model.measureNumRules(), new weka.core.Version().toString());
  }
}
