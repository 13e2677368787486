// The program llmt: its --json output and the files that it writes.
#include "bytes/cases.hpp"
#include "bytes/program_runs.hpp"
#include "bytes/samples.hpp"
#include "llmt/files.hpp"

namespace bytes {
namespace {

const std::string llmt_program = "'" LLMT_PROGRAM "' ";

void write_tables(const std::string& folder) {
  Sample sample = make_sample(240, 6);
  add_output(sample);
  Eigen::MatrixXd table(240, 5);
  table << sample.inputs, sample.outputs;
  llmt::write_file(folder + "/plain.csv", to_csv({"a", "b", "c", "y", "z"}, table));
  make_categorical(sample);
  remove_values(sample.inputs);
  table << sample.inputs.leftCols(2), sample.inputs.col(2), sample.outputs.col(0), make_weights(240);
  std::string mixed = to_csv({"a", "b", "kind", "y", "w"}, table);
  llmt::write_file(folder + "/mixed.csv", mixed);
  llmt::write_file(folder + "/queries.csv", to_csv({"a", "b", "c"}, make_queries()));

  // A simulation and measurements beside it: a step, a slope and noise are missing.
  Generator generator(8);
  Eigen::MatrixXd simulated(160, 4);
  Eigen::MatrixXd measured(160, 4);
  for (Eigen::Index row = 0; row < 160; ++row) {
    const double a = 5.0 * generator.uniform();
    const double b = 2.0 * generator.uniform() - 1.0;
    const double t = static_cast<double>(row);
    const double y = 1.0 + 0.5 * a - b * b;
    const double hidden = (a > 3.2 ? 0.4 : 0.0) + 0.3 * b * a;
    simulated.row(row) << a, b, t, y;
    measured.row(row) << a, b, t, y + hidden + 0.05 * generator.noise();
  }
  llmt::write_file(folder + "/s.csv", to_csv({"a", "b", "t", "y"}, simulated));
  llmt::write_file(folder + "/m.csv", to_csv({"a", "b", "t", "y"}, measured));
  llmt::write_file(folder + "/own.txt", "a_times_b = a * b\n");
}

}  // namespace

void witness_llmt(const std::string& folder, Results& results) {
  write_tables(folder);
  const auto add = [&](const std::string& name, const std::string& arguments, std::vector<std::string> files = {}) {
    results["llmt/" + name] = run_and_hash(folder, llmt_program + arguments, files);
  };
  const auto add_threads = [&](const std::string& name, const std::string& arguments,
                               const std::vector<std::string>& files) {
    add_for_threads(results, "llmt/" + name, [&](int threads) {
      return run_and_hash(folder, llmt_program + arguments + " --threads " + std::to_string(threads), files);
    });
  };
  add_threads("fit", "fit plain.csv -t y --ignore z --cv 3 -o plain.json --json", {"plain.json"});
  add_threads("fit_two_targets", "fit plain.csv -t y -t z --cv 3 --shared --validity blend -o two.json --json",
              {"two.json"});
  add_threads("fit_mixed", "fit mixed.csv -t y --categorical kind --weight w --cv 3 -o mixed.json --json",
              {"mixed.json"});
  add("fit_hilomot", "fit plain.csv -t y --ignore z --cv 3 --rule hilomot -o gates.json --json", {"gates.json"});
  add("fit_m5", "fit plain.csv -t y --ignore z --cv 3 --rule m5 -o m5.json --json", {"m5.json"});
  add("fit_monotone", "fit plain.csv -t y --ignore z --cv 3 --monotone a --slope-sign=-c --json");
  add("fit_stream", "fit plain.csv -t y --ignore z --stream -o stream.json --json", {"stream.json"});
  add_threads("predict", "predict plain.json queries.csv --json", {});
  add_threads("predict_to_file", "predict two.json queries.csv --interval 0.8 -o predicted.csv --json",
              {"predicted.csv"});
  for (const std::string model : {"plain", "two", "mixed", "gates", "m5", "stream"}) {
    add("inspect_" + model, "inspect " + model + ".json --json");
  }
  add_threads("explain", "explain plain.json queries.csv --json", {});
  add_threads("explain_row", "explain two.json queries.csv --row 3 --json", {});
  add_threads("compare", "compare plain.csv -t y --ignore z --cv 2 --json", {});
  add("discover", "discover s.csv m.csv --inputs a,b,t --target y -o corrected.csv --json", {"corrected.csv"});
  add("discover_own_term", "discover s.csv m.csv --target y --terms own.txt --own-terms-only --json");
  add("discover_nothing", "discover s.csv s.csv --target y --json");
  add("no_such_target", "fit plain.csv -t nothing --json");
  add("no_such_rule", "fit plain.csv -t y --rule nothing --json");
}

}  // namespace bytes
