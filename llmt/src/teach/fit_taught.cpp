#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

#include "fit/prepared_rows.hpp"
#include "fit/trees/error_weights.hpp"
#include "fit/trees/held_out_error.hpp"
#include "llmt/teach.hpp"
#include "selection/fold_errors.hpp"
#include "selection/selection.hpp"
#include "teach/learned.hpp"

namespace llmt {
namespace {

void check(const TeachOptions& options) {
  const auto refuse = [](const std::string& what) { throw std::invalid_argument("llmt::fit_taught: " + what); };
  if (options.made_rows < 0) refuse(fmt::format("made_rows is {}, it must not be negative", options.made_rows));
  if (options.most_made_rows < 0) {
    refuse(fmt::format("most_made_rows is {}, it must not be negative", options.most_made_rows));
  }
  if (options.neighbours < 1) refuse(fmt::format("neighbours is {}, it must be at least 1", options.neighbours));
  if (!(options.swapped >= 0.0 && options.swapped <= 1.0)) {
    refuse(fmt::format("swapped is {}, it must be from 0 to 1", options.swapped));
  }
}

// The error of the teachers on the rows on which trees are compared.
double error_of_teachers(const Training& training, const std::vector<Eigen::MatrixXd>& answers,
                         const std::vector<int>& served) {
  const Eigen::VectorXd weights = error_weights(*training.table, served);
  std::vector<FoldRows> folds;
  std::vector<double> sums;
  for (std::size_t f = 0; f < training.folds.size(); ++f) {
    const std::vector<int>& all = training.folds[f].held_out.rows;
    const FoldRows& fold =
        folds.emplace_back(training.folds[f].training, subsample(training.folds[f].held_out, most_held_out_rows));
    const TrainingRows& held_out = fold.held_out;
    double& sum = sums.emplace_back(0.0);
    for (const int row : held_out.rows) {
      const Eigen::Index place = std::ranges::lower_bound(all, row) - all.begin();
      const double weight = held_out.weight_unit * held_out.table->weights(row);
      for (std::size_t o = 0; o < served.size(); ++o) {
        const double residual = held_out.table->outputs(row, served[o]) - answers[f](place, served[o]);
        sum += weight * weights(static_cast<Eigen::Index>(o)) * residual * residual;
      }
    }
  }
  return FoldErrors(folds, std::ssize(served))({}, sums).rmse;
}

// True if the taught trees have the smaller error; each counts in units of the error of the tree fitted to the data.
bool is_better(const FitSummary& taught, const FitSummary& alone) {
  std::vector<CandidateError> of_taught;
  std::vector<CandidateError> of_alone;
  for (std::size_t p = 0; p < alone.partitions.size(); ++p) {
    of_taught.push_back(taught.partitions[p].chosen);
    of_alone.push_back(alone.partitions[p].chosen);
  }
  return mean_error(of_taught, of_alone).rmse < mean_error(of_alone, of_alone).rmse;
}

}  // namespace

std::string why_not_taught(const FitOptions& options) {
  if (options.folds.count == 0) return "folds.count 0: what teaching brings is measured on held-out rows";
  return "";
}

TaughtResult fit_taught(const PreparedFit& prepared, const TeachOptions& options, const Progress& progress) {
  check(options);
  const PreparedRows& rows = prepared.rows();
  const Training& training = *rows.training;
  if (const std::string why = why_not_taught(training.options); !why.empty()) {
    throw std::invalid_argument("llmt::fit_taught: teaching does not go with " + why);
  }
  if (training.folds.empty()) {
    throw std::invalid_argument(
        "llmt::fit_taught: the rows leave none to hold out, and what teaching brings is measured there");
  }
  Work work(progress);
  Work fitting(work, 0.2);
  FitResult alone = fit(prepared, fitting.progress());
  Work teaching(work, 0.4);
  Taught made = teach(training, options, teaching);
  const Eigen::Index made_rows = made.lessons.of_all->inputs.rows() - training.all.count();
  PreparedRows taught_rows = rows;
  taught_rows.training =
      std::make_shared<const Training>(taught(training, std::make_shared<const Lessons>(std::move(made.lessons))));
  const PreparedFit with_lessons = prepared.with_rows(std::move(taught_rows));
  Work learning(work, work.left());
  FitResult taught = fit(with_lessons, learning.progress());
  std::vector<TaughtPartition> partitions;
  for (std::size_t p = 0; p < alone.summary.partitions.size(); ++p) {
    const std::vector<int>& served = alone.summary.partitions[p].outputs;
    partitions.push_back({.outputs = served,
                          .alone = alone.summary.partitions[p].chosen.rmse,
                          .taught = taught.summary.partitions[p].chosen.rmse,
                          .teacher = error_of_teachers(training, made.held_out, served)});
  }
  const bool is_taken = is_better(taught.summary, alone.summary);
  work.finish();
  return {.fit = std::move(is_taken ? taught : alone),
          .prepared = is_taken ? with_lessons : prepared,
          .partitions = std::move(partitions),
          .is_taken = is_taken,
          .made_rows = made_rows};
}

TaughtResult fit_taught(const TrainingData& data, const FitOptions& options, const TeachOptions& teach,
                        const Progress& progress) {
  Work work(progress);
  Work preparing(work, 0.05);
  const PreparedFit prepared(data, options, preparing.progress());
  Work fitting(work, work.left());
  TaughtResult result = fit_taught(prepared, teach, fitting.progress());
  work.finish();
  return result;
}

}  // namespace llmt
