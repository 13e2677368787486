// The exact search against the search by bins and against residual analysis, which does not search: whole growths of a
// crisp tree, one thread: from which size on bins pay, and what they cost in error. CPU seconds, error = RMSE to the
// function without noise on 100000 fresh rows.
//
// search_modes [ROWS...]
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <string>

#include "llmt/fit.hpp"
#include "synthetic.hpp"

namespace {

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

void measure(Eigen::Index rows, Eigen::Index inputs) {
  const bench::Sample train = bench::sample(rows, inputs, 1);
  const bench::Sample test = bench::sample(100000, inputs, 2);
  std::string line = fmt::format("{:9} {:3}", rows, inputs);
  double exact_seconds = 0.0;
  for (int method = 0; method < 3; ++method) {
    llmt::FitOptions options;
    options.growth.search = method == 0 ? llmt::SplitSearch::exact : llmt::SplitSearch::binned;
    options.growth.rule = method == 2 ? llmt::GrowthRule::ra : llmt::GrowthRule::rd;
    options.blend.validity = llmt::ValidityChoice::crisp;
    options.selection.folds.count = 0;
    options.max_threads = 1;
    const double start = cpu_seconds();
    const llmt::FitResult result = llmt::fit(train.x, train.y, options);
    const double seconds = cpu_seconds() - start;
    exact_seconds = method == 0 ? seconds : exact_seconds;
    const double error = std::sqrt((result.model.predict(test.x).col(0) - test.truth).squaredNorm() / 100000.0);
    const llmt::PartitionSummary& summary = result.summary.partitions[0];
    line += fmt::format(" {:10.3f} {:8.4f} {:7}", seconds, error, summary.leaves);
    if (method > 0) {
      line += fmt::format(" {:8.2f}", exact_seconds / seconds);
    }
    if (method == 1) {
      line += fmt::format(" {:10.1e}", summary.search.largest_excess);
    }
  }
  fmt::print("{}\n", line);
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print("{:>9} {:>3} {:>10} {:>8} {:>7} {:>10} {:>8} {:>7} {:>8} {:>10} {:>10} {:>8} {:>7} {:>8}\n", "rows", "d",
             "exact, s", "error", "leaves", "binned, s", "error", "leaves", "ratio", "excess <=", "RA, s", "error",
             "leaves", "ratio");
  std::vector<Eigen::Index> sizes;
  for (int k = 1; k < argc; ++k) {
    sizes.push_back(std::atol(argv[k]));
  }
  if (sizes.empty()) {
    sizes = {10000, 30000, 100000, 300000};
  }
  for (const Eigen::Index rows : sizes) {
    for (const Eigen::Index inputs : {2, 10, 20}) {
      measure(rows, inputs);
    }
  }
  return 0;
}
