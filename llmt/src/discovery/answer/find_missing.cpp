#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "discovery/answer/averaged_rows.hpp"
#include "discovery/answer/contests.hpp"
#include "discovery/answer/findings.hpp"
#include "discovery/answer/judges.hpp"
#include "discovery/answer/one_search.hpp"
#include "discovery/answer/refusals.hpp"
#include "discovery/recording/apart.hpp"
#include "discovery/recording/noise.hpp"
#include "discovery/recording/recording.hpp"
#include "discovery/recording/row_split.hpp"
#include "discovery/recording/speeds.hpp"
#include "discovery/terms/term_model.hpp"
#include "llmt/discovery/simulation.hpp"

namespace llmt::discovery {
namespace {

// The zero bands of rows in time.
Recording with_rest(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured) {
  const Inputs& inputs = recording.inputs();
  if (!recording.is_in_time() || inputs.zero_bands.size() > 0) return recording;
  const Eigen::MatrixXd simulated = simulation.predict(inputs.values, values_of(simulation.parameters));
  // What has the wrong shape is refused by the search.
  if (simulated.rows() != measured.values.rows() || simulated.cols() != measured.values.cols()) return recording;
  // Dry friction jumps where a speed passes 0, that of the simulation beside what it lacks.
  const std::shared_ptr<const Surrogate> surrogate = recording.surrogate(simulated);
  Eigen::MatrixXd deviations = measured.values - recording.as_measured(simulated);
  if (surrogate->described().minCoeff() >= roughly_described) {
    deviations += recording.as_measured(surrogate->jumps(inputs.values));
  }
  const Eigen::VectorXd bands = zero_bands(recording, deviations);
  return (bands.array() > 0.0).any() ? recording.with_zero_bands(bands) : recording;
}

// Searches until what is found holds on the rows set aside. Terms that are refuted there are no candidates of the next
// search, which sets other rows aside. In time, what follows noise that is alike in neighbours lives on few rows: a
// term must shrink the gap on the rows set aside, of one search or the next.
Missing find_at(const Simulation& simulation, const SmoothedInputs& smooth, const MeasuredOutputs& measured,
                const std::vector<ModelTerm>& terms, const SearchedRows& rows, MissingOptions& options,
                std::set<std::size_t>& refuted, Missing missing) {
  const bool in_time = smooth.recording.is_in_time();
  const int most = in_time ? 4 : 3;
  std::set<std::size_t> unproven;
  std::vector<std::string> notes;
  for (int trial = 1;; ++trial) {
    if (trial > 1) missing = search_once(simulation, smooth.recording, measured, terms, rows, options, refuted);
    const std::set<std::size_t> beyond = beyond_constants(missing, terms);
    const std::set<std::size_t> narrow = narrower_than_errors(missing, terms, smooth.recording, smooth.errors);
    const std::set<std::size_t> chance = states_by_chance(missing);
    const auto is_unproven = [&](const FoundTerm& found) { return in_time && !found.shrinks_gap; };
    const bool holds =
        missing.answer != Answer::failed_held_out && std::ranges::none_of(missing.found, [&](const FoundTerm& found) {
          return is_unproven(found) || beyond.contains(found.term) || narrow.contains(found.term) ||
                 chance.contains(found.term);
        });
    if (holds || (trial >= most && beyond.empty() && narrow.empty())) {
      missing.notes.insert(missing.notes.begin(), notes.begin(), notes.end());
      return missing;
    }
    refuted.insert(beyond.begin(), beyond.end());
    for (const FoundTerm& found : missing.found) {
      const bool fails_again = is_unproven(found) && !unproven.insert(found.term).second;
      const bool is_narrow = narrow.contains(found.term);
      const bool is_chance = chance.contains(found.term);
      if (!found.is_refuted && !fails_again && !is_narrow && !is_chance) continue;
      refuted.insert(found.term);
      for (std::size_t t = 0; t < terms.size() && is_chance; ++t) {
        if (terms[t].family == found.family) refuted.insert(t);  // of other inputs it would do the same
      }
      const std::string place = found.location.empty() ? "" : " " + found.location;
      const std::string name = found.generic ? "an error pattern of" + place : found.family + place;
      notes.push_back(name + " was found and taken back: " +
                      (is_narrow   ? fmt::format("it is narrower than the errors of {}, or than its steps between rows",
                                                 found.location)
                       : is_chance ? "errors of the inputs can make such a state"
                       : found.is_refuted ? "it makes the error on rows set aside larger"
                                          : "it does not make the error on rows set aside smaller"));
    }
    ++options.seed;
  }
}

// Whether a state that rings after reversals explains more than any other term.
bool resonance_comes_first(const Missing& missing, const std::vector<ModelTerm>& terms) {
  double of_resonance = 0.0;
  double of_others = 0.0;
  for (const FoundTerm& found : missing.found) {
    const ModelTerm& term = terms[found.term];
    const bool rings = !term.inner_state.empty() && !term.constants.empty();
    double& largest = rings ? of_resonance : of_others;
    largest = std::max(largest, found.share);
  }
  return of_resonance > of_others;
}

// What find_at() begins with.
struct Beginning {
  SearchedRows rows;
  Missing missing;
  std::vector<Apart> at_reversals;
};

// Chooses the rows: averaged or not, with reversals or without. Ends where a state has constants beyond those tried.
Beginning begin(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                const std::vector<ModelTerm>& terms, SearchedRows rows, const MissingOptions& options,
                const std::set<std::size_t>& refuted) {
  Beginning now{std::move(rows), {}, {}};
  const auto search = [&] {
    now.missing = search_once(simulation, recording, measured, terms, now.rows, options, refuted);
  };
  const auto is_beyond = [&] { return !beyond_constants(now.missing, terms).empty(); };
  search();
  // Filtered alike, the simulation is right at reversals, and samples are as far apart as they are independent.
  if (!recording.is_in_time() || recording.is_filtered() || is_beyond()) return now;
  // What is left is alike in neighbours: single rows say little more than their means, which hold less noise. A state
  // is of single rows, and rings after reversals.
  constexpr Eigen::Index fewest_of_alike = 80;
  constexpr Eigen::Index samples_for_a_parameter = 10;
  const auto free = std::ranges::count_if(simulation.parameters, &Parameter::free);
  if (!resonance_comes_first(now.missing, terms) && now.missing.time.independent_share < alike_in_neighbours) {
    now.rows.fewest_samples = fewest_of_alike + samples_for_a_parameter * free;
    search();
  }
  constexpr int most = 3;
  for (int k = 0; k < most && !is_beyond() && !resonance_comes_first(now.missing, terms); ++k) {
    const std::vector<Apart> at_reversals =
        rows_apart(ApartWhen::after_a_search, {recording, measured, now.missing.corrected, &now.missing});
    if (at_reversals.empty()) break;
    mark(at_reversals, now.rows.apart);
    search();
    now.at_reversals = at_reversals;
  }
  return now;
}

// The search sees inputs without most of their errors. The answer is of the rows as they were given.
Missing find(const Simulation& simulation, const Recording& as_given, const MeasuredOutputs& measured,
             const std::vector<ModelTerm>& terms, MissingOptions options) {
  options.search.simplest_of_rivals = as_given.is_in_time();
  const Eigen::MatrixXd& inputs_as_given = as_given.inputs().values;
  const Eigen::MatrixXd simulated = simulation.predict(inputs_as_given, values_of(simulation.parameters));
  SmoothedInputs smooth = smoothed(as_given, simulated);
  const bool is_smoothed = smooth.change.size() > 0;
  Simulation there = simulation;
  if (is_smoothed) {
    there.predict = [&](const Eigen::MatrixXd&, const Eigen::VectorXd& values) -> Eigen::MatrixXd {
      return simulation.predict(inputs_as_given, values) + smooth.change;
    };
  }
  const Recording resting = with_rest(there, smooth.recording, measured);
  const Eigen::MatrixXd as_measured = as_given.as_measured(simulated);
  std::vector<Apart> apart = rows_apart(ApartWhen::before_searches, {resting, measured, as_measured});
  smooth.recording = resting.with_zero_bands(bands_of_errors(resting.inputs()));
  const Recording& recording = smooth.recording;
  SearchedRows rows{.apart = std::vector<bool>(inputs_as_given.rows(), false),
                    .bands_of_rest = resting.inputs().zero_bands};
  mark(apart, rows.apart);
  for (const Eigen::Index row : smooth.unknown_sign) rows.apart[row] = true;
  if (recording.is_filtered()) rows.columns = std::make_shared<ColumnCache>(recording);
  std::set<std::size_t> refuted = terms_of_regimes(terms);
  Beginning beginning = begin(there, recording, measured, terms, rows, options, refuted);
  // The filter of a recording looks like a state whose constants are not those of a machine.
  for (auto beyond = beyond_constants(beginning.missing, terms); !beyond.empty();
       beyond = beyond_constants(beginning.missing, terms)) {
    refuted.insert(beyond.begin(), beyond.end());
    beginning = begin(there, recording, measured, terms, rows, options, refuted);
  }
  const SearchedRows& searched = beginning.rows;
  Missing missing = find_at(there, smooth, measured, terms, searched, options, refuted, std::move(beginning.missing));
  if (recording.is_in_time() && !missing.held_out.empty()) {
    const CrossValidation validation(there, recording, measured, terms, searched, options);
    const auto search = [&](const std::vector<ModelTerm>& others, const std::set<std::size_t>& left_out) {
      return search_once(there, recording, measured, others, searched, options, left_out);
    };
    missing = contested(std::move(missing), terms, refuted, validation, search);
  }
  fit_on_all_rows(there, recording, measured, terms, searched, options, missing);
  missing.zero_bands = recording.inputs().zero_bands;
  missing.time.filtered = recording.is_filtered();
  if (is_smoothed) {
    missing.before -= smooth.change;
    missing.corrected = as_given.as_measured(with_found_terms(simulation, missing, terms, as_given));
    missing.change_by_smoothing = smooth.change;
  }
  std::ranges::move(beginning.at_reversals, std::back_inserter(apart));
  std::vector<std::string> notes = smooth.notes;
  tell(apart, notes);
  missing.notes.insert(missing.notes.begin(), notes.begin(), notes.end());
  return missing;
}

// Of a log with more rows than a search can use, means over few rows are searched.
Missing find_in_rows(const Simulation& simulation, const Recording& recording, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const MissingOptions& options) {
  const std::optional<AveragedRows> few = averaged(recording, measured, options);
  if (!few) return find(simulation, recording, measured, terms, options);
  const Simulation of_means = averaged(simulation, recording.inputs(), few->blocks);
  return of_all_rows(find(of_means, few->recording, few->measured, terms, options), *few, simulation, terms, recording);
}

// Whether what is left is alike in neighbouring rows.
bool is_alike_in_neighbours(const MeasuredOutputs& measured, const Missing& missing) {
  constexpr double alike = 0.6;  // independent share
  const Eigen::Index n = measured.values.rows();
  const std::vector<Eigen::Index> one_stretch(n, 0);
  std::vector<bool> used(n, true);
  for (const Eigen::Index row : missing.outliers) used[row] = false;
  for (Eigen::Index o = 0; o < measured.values.cols(); ++o) {
    const Eigen::VectorXd left = measured.values.col(o) - missing.corrected.col(o);
    if (independent_share(autocorrelation(left, one_stretch, used)) < alike) return true;
  }
  return false;
}

// Rows that nobody said to be a log are searched as one where what is left is alike in neighbours.
Missing find_along_rows(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
                        const std::vector<ModelTerm>& terms, const MissingOptions& options) {
  constexpr Eigen::Index fewest = 100;  // rows that are taken for a log although nobody said so
  const bool is_told = inputs.instants.size() > 0 || !inputs.order.empty() || inputs.values.rows() < fewest;
  const AlongRows rows = is_told ? AlongRows::independent : along_rows(inputs, options);
  Missing missing;
  if (rows != AlongRows::measured_signal) {
    missing = find_in_rows(simulation, Recording(inputs), measured, terms, options);
    if (rows == AlongRows::independent || !is_alike_in_neighbours(measured, missing)) return missing;
  }
  Inputs in_time = inputs;
  in_time.instants =
      Eigen::VectorXd::LinSpaced(inputs.values.rows(), 0.0, static_cast<double>(inputs.values.rows() - 1));
  missing = find_in_rows(simulation, Recording(std::move(in_time)), measured, terms, options);
  missing.time.found_out = true;
  return missing;
}

// How many searches there will be is not known, so each counts as half of what the ones before it left.
class ProgressOfSearches {
 public:
  explicit ProgressOfSearches(Progress whole) {
    if (whole) shown_ = std::make_shared<Shown>(Shown{std::move(whole), 0, 0, {}});
  }

  // What the searches report to, one after another. Empty if that of the whole call is.
  Progress of_each() const {
    if (!shown_) return {};
    return [shown = shown_](const ProgressReport& report) {
      if (report.done < shown->of_search) shown->begin = shown->reported.done;
      shown->of_search = report.done;
      const double half = 0.5 * (report.total - shown->begin);
      shown->reported = report;
      shown->reported.done = shown->begin + static_cast<int>(half * report.done / report.total);
      return shown->whole(shown->reported);
    };
  }

  // Reports the whole call as complete. Throws Cancelled if the callback says so.
  void finish() const {
    if (!shown_) return;
    shown_->reported.done = shown_->reported.total;
    if (!shown_->whole(shown_->reported)) throw Cancelled();
  }

 private:
  struct Shown {
    Progress whole;
    int begin = 0;            // where the present search began
    int of_search = 0;        // what it reported last
    ProgressReport reported;  // to the caller
  };
  std::shared_ptr<Shown> shown_;  // null: nobody watches
};

}  // namespace

Missing find_missing(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
                     const std::vector<ModelTerm>& terms, const MissingOptions& options) {
  refuse_wrong(simulation, inputs, measured, options);
  const auto run = [&] { return simulation.predict(inputs.values, values_of(simulation.parameters)); };
  const Eigen::MatrixXd simulated = run();
  // What has the wrong shape is refused by the search.
  if (simulated.rows() == measured.values.rows() && simulated.cols() == measured.values.cols()) {
    refuse_random(simulated, run(), measured.names);
  }
  refuse_determined(simulation, inputs, measured);
  const ProgressOfSearches progress(options.progress);
  MissingOptions watched = options;
  watched.progress = progress.of_each();
  Missing missing = find_along_rows(simulation, inputs, measured, terms, watched);
  progress.finish();
  if (!missing.found.empty()) {
    missing.range_of_terms = range_of_found_terms(simulation, missing, terms, Recording(inputs));
  }
  return missing;
}

Eigen::MatrixXd corrected(const Simulation& simulation, const Missing& missing, const std::vector<ModelTerm>& terms,
                          const Inputs& inputs) {
  return with_found_terms(simulation, missing, terms, Recording(inputs));
}

}  // namespace llmt::discovery
