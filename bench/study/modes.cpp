// The exact search against the search by bins and against residual analysis, which does not search: whole growths of a
// crisp tree, one thread. Shows from which number of rows on bins pay, and what they cost in error. CPU seconds; error:
// RMSE to the function without noise on 100000 fresh rows.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "methods.hpp"
#include "resources.hpp"
#include "study/study.hpp"
#include "synthetic.hpp"

namespace bench {
namespace {

struct Growth {
  double seconds = 0.0;  // CPU
  double rmse = 0.0;
  llmt::PartitionSummary summary;
};

Growth grow(const Sample& train, const Sample& test, llmt::GrowthRule rule, llmt::SplitSearch search) {
  llmt::FitOptions options = crisp(with_rule(rule));
  options.expert.search = search;
  options.folds.count = 0;
  options.max_threads = 1;
  std::optional<llmt::FitResult> fit;
  const Cost cost = measure([&] { fit = llmt::fit(train.x, train.y, options); });
  return {cost.cpu, error(fit->model.predict(test.x), test), fit->summary.partitions[0]};
}

std::string cells(const Growth& growth) {
  return fmt::format(" {:10.3f} {:8.4f} {:7}", growth.seconds, growth.rmse, growth.summary.leaves);
}

void compare_searches(Eigen::Index rows, Eigen::Index inputs) {
  using llmt::GrowthRule;
  using llmt::SplitSearch;
  const Sample train = sample(rows, inputs, 1);
  const Sample test = sample(100000, inputs, 2);
  const Growth exact = grow(train, test, GrowthRule::rd, SplitSearch::exact);
  const Growth binned = grow(train, test, GrowthRule::rd, SplitSearch::binned);
  const Growth ra = grow(train, test, GrowthRule::ra, SplitSearch::binned);
  fmt::print("{:9} {:3}{}{} {:8.2f} {:10.1e}{} {:8.2f}\n", rows, inputs, cells(exact), cells(binned),
             exact.seconds / binned.seconds, binned.summary.search.largest_excess, cells(ra),
             exact.seconds / ra.seconds);
  std::fflush(stdout);
}

}  // namespace

void add_modes(CLI::App& study) {
  const auto sizes =
      std::make_shared<std::vector<Eigen::Index>>(std::initializer_list<Eigen::Index>{10000, 30000, 100000, 300000});
  CLI::App* command = study.add_subcommand("modes", "Exact search, search by bins and residual analysis");
  command->add_option("rows", *sizes, "numbers of training rows")->capture_default_str();
  command->callback([sizes] {
    fmt::print("{:>9} {:>3} {:>10} {:>8} {:>7} {:>10} {:>8} {:>7} {:>8} {:>10} {:>10} {:>8} {:>7} {:>8}\n", "rows", "d",
               "exact, s", "error", "leaves", "binned, s", "error", "leaves", "ratio", "excess <=", "RA, s", "error",
               "leaves", "ratio");
    for (const Eigen::Index rows : *sizes) {
      for (const Eigen::Index inputs : {2, 10, 20}) compare_searches(rows, inputs);
    }
  });
}

}  // namespace bench
