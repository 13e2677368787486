#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>

#include "llmt/arrow.hpp"
#include "llmt/boosted.hpp"
#include "llmt/fit.hpp"
#include "llmt/readable.hpp"
#include "llmt/teach.hpp"
#include "llmt/time_limit.hpp"
#include "report/document/document_text.hpp"
#include "report/fit/fit_summary.hpp"
#include "report/fit/neighbours.hpp"
#include "report/fit/of_fit.hpp"
#include "report/fit/readable_summary.hpp"
#include "report/fit/teaching_summary.hpp"
#include "report/fit/time_limit.hpp"
#include "shared/cli.hpp"
#include "shared/help.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"
#include "shared/table_file.hpp"
#include "trees/arrow_fit.hpp"
#include "trees/boost_command.hpp"
#include "trees/commands.hpp"
#include "trees/dynamic_fit.hpp"
#include "trees/fit_options.hpp"
#include "trees/gross_errors.hpp"
#include "trees/learning.hpp"
#include "trees/stream_command.hpp"

namespace llmt::apps {
namespace {

struct FitArguments {
  LearningArguments learning;
  std::string output;
  bool json = false;
  bool stream = false;
  bool boost = false;
  int seeds = 1;
  int max_rounds = BoostOptions().max_rounds;
  double time_limit = 0.0;  ///< in seconds; 0: none
  bool teach = false;
  ArrowFitArguments arrow;
  DynamicArguments dynamic;
  std::string readable;             ///< the loss in per cent; empty: none is asked for
  Eigen::Index readable_rules = 0;  ///< 0: the default step
  ReportFiles reports;
};

constexpr NumberRange per_cent = {0.0, 1000.0, "a number of per cent from 0 to 1000"};
constexpr const char* readable_extension = ".readable.json";

// Whether the model's file has intervals.
bool keeps_intervals(const FitArguments& arguments) {
  return arguments.learning.options.intervals && !arguments.output.empty();
}

// The rows are made ready once, for the model and the readable tree.
struct Fitting {
  PreparedFit prepared;
  FitResult result;
  std::optional<TaughtResult> taught = {};
  std::optional<TimeLimit> time = {};
};

// `table`: gets the options of the fit that the time was enough for.
Fitting fit_with_bar(const FitArguments& arguments, LearningTable& table) {
  ProgressBar bar("fitting");
  if (arguments.time_limit > 0.0) {
    TimedTree timed = fit_within(arguments.time_limit, table.data, table.options, bar.callback());
    table.options = std::move(timed.options);
    return {timed.prepared, std::move(timed.fit), {}, timed.time};
  }
  Work work(bar.callback());
  Work preparing(work, table.options.loss == Loss::tukey ? 0.2 : 0.05);
  const PreparedFit prepared(table.data, table.options, preparing.progress());
  Work fitting(work, work.left());
  if (!arguments.teach) return {prepared, fit(prepared, fitting.progress())};
  TaughtResult taught = fit_taught(prepared, {.seed = table.options.folds.seed}, fitting.progress());
  return {taught.prepared, taught.fit, taught};
}

// The readable tree beside the model, written if the model is.
std::optional<ReadableResult> make_readable(const FitArguments& arguments, const Fitting& fitting,
                                            const ReadableOptions& asked) {
  const FitSummary& fitted = fitting.result.summary;
  if (fitted.partitions.front().cv_folds == 0) {
    throw std::runtime_error(
        fmt::format("{}: --readable chooses on held-out rows, and the {} row(s) leave none to hold out",
                    table_name(arguments.learning.data), fitted.samples));
  }
  ProgressBar bar("readable tree");
  ReadableResult readable = fit_readable(fitting.prepared, fitted, asked, bar.callback());
  bar.clear();
  if (!arguments.output.empty()) {
    save(readable.model, keeps_intervals(arguments) ? readable.intervals : Intervals(),
         beside(arguments.output, readable_extension).string());
  }
  return readable;
}

// A report shows a readable tree beside the model wherever one can be made. It does not show rows that the loss leaves
// out: they would set the axes.
std::string write_fit_reports(const FitArguments& arguments, const LearningTable& table, const Fitting& fitting,
                              const std::optional<ReadableResult>& readable, const report::Document& words) {
  if (!arguments.reports.wanted()) return "";
  const FitResult& result = fitting.result;
  std::optional<ReadableResult> shown = readable;
  const bool has_folds = result.summary.partitions.front().cv_folds > 0;
  if (!shown && has_folds && why_not_readable(table.options).empty()) {
    shown = fit_readable(fitting.prepared, result.summary);
  }
  const TrainingData& data = *table.data;
  const std::vector<Eigen::Index> left_out = report::rows_left_out(result.summary.loss_weights, data.weights);
  const auto report_on = [&](const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs, const FitResult& of_rows) {
    const report::Fitted fitted{arguments.learning.data, inputs, outputs, table.options, of_rows, shown,
                                std::ssize(left_out)};
    return write_reports(arguments.reports, report::fit_report(fitted, words));
  };
  if (left_out.empty()) return report_on(data.inputs, data.outputs, result);
  std::vector<Eigen::Index> kept;
  std::vector<Eigen::Index> place(data.outputs.rows(), -1);  // among the kept rows
  for (Eigen::Index row = 0; row < data.outputs.rows(); ++row) {
    if (!(result.summary.loss_weights(row) > 0.0)) continue;
    place[row] = std::ssize(kept);
    kept.push_back(row);
  }
  FitResult of_kept = result;
  for (std::vector<Eigen::Index>& of_fold : of_kept.summary.held_out) {
    for (Eigen::Index& row : of_fold) row = place[row];
  }
  return report_on(data.inputs(kept, Eigen::all), data.outputs(kept, Eigen::all), of_kept);
}

// What blocks of consecutive rows as folds would say, where rows that follow each other are alike; else nothing.
std::optional<std::string> words_of_neighbours(const LearningTable& table, const Fitting& fitting) {
  const FitResult& result = fitting.result;
  const double correlation = report::neighbours_correlation(*table.data, table.options, result);
  if (!report::are_alike(correlation, table.data->inputs.rows())) return std::nullopt;
  FitOptions contiguous = table.options;
  contiguous.folds.kind = FoldKind::contiguous;
  contiguous.intervals = false;
  const double own = result.summary.partitions.front().chosen.rmse;
  // This fit takes about as long again, which a time limit does not have.
  if (fitting.time) return report::neighbours_text(correlation, own, std::nullopt);
  ProgressBar bar("blocks of rows");
  const FitResult other = fit(*table.data, contiguous, bar.callback());
  bar.clear();
  return report::neighbours_text(correlation, own, other.summary.partitions.front().chosen.rmse);
}

void fit_command(FitArguments arguments) {
  ReadableOptions asked{.rules = arguments.readable_rules};
  if (asked.rules > 0 && arguments.readable.empty()) arguments.readable = "15";
  if (!arguments.readable.empty()) asked.loss = read_number("--readable", arguments.readable, per_cent) / 100.0;
  LearningTable table = read_learning_table(arguments.learning);
  if (const std::string why = why_not_taught(table.options); arguments.teach && !why.empty()) {
    throw std::invalid_argument("llmt::fit_taught: --teach does not go with " + why);
  }
  if (const std::string why = why_not_readable(table.options); !arguments.readable.empty() && !why.empty()) {
    throw std::invalid_argument("llmt::fit_readable: --readable does not go with " + why);
  }
  // Folds' models say which rows no model predicts; the report needs them too, and the file unless it is to be small.
  const bool looks_for_gross_errors = table.options.loss == Loss::squared;
  table.options.intervals = keeps_intervals(arguments) || arguments.reports.wanted() || looks_for_gross_errors;
  Fitting fitting = fit_with_bar(arguments, table);
  FitResult& result = fitting.result;
  warn_of_gross_errors(arguments.learning, table, result);
  if (!arguments.output.empty()) {
    save(result.model, keeps_intervals(arguments) ? result.intervals : Intervals(), arguments.output);
  }
  std::optional<ReadableResult> readable;
  if (!arguments.readable.empty()) readable = make_readable(arguments, fitting, asked);
  const std::optional<std::string> neighbours = words_of_neighbours(table, fitting);
  const auto run_of = [&](const std::string& data, const std::string& output) {
    return report::FitRun{data, table.options, *table.data, table.lines, output};
  };
  const auto words_for = [&](const std::string& output) {
    report::Document words = report::fit_words(run_of(table_name(arguments.learning.data), output), result);
    if (neighbours) words.notes.push_back(*neighbours);
    if (fitting.time) words.notes.push_back(report::time_limit_text(*fitting.time, report::LimitedSize::leaves));
    if (fitting.taught) words.sections.push_back(report::teaching_words(*fitting.taught));
    if (readable) words.sections.push_back(report::readable_words(result, *readable, asked));
    return words;
  };
  // A page goes to others, whom the place of the file does not concern.
  const std::string reports = write_fit_reports(arguments, table, fitting, readable, words_for(""));
  if (arguments.json) {
    const report::FitRun run = run_of(arguments.learning.data, arguments.output);
    Json summary = report::fit_json(run, result);
    if (fitting.time) summary["time_limit"] = report::time_limit_json(*fitting.time, report::LimitedSize::leaves);
    if (fitting.taught) summary["teaching"] = report::teaching_json(*fitting.taught);
    if (readable) summary["readable"] = report::readable_json(result, *readable, asked);
    print_json(summary);
    return;
  }
  print(report::document_text(words_for(arguments.output), output_width()));
  if (readable && !arguments.output.empty()) {
    print(fmt::format("Readable tree written to {}; llmt inspect --rules prints it\n",
                      beside(arguments.output, readable_extension).string()));
  }
  print(reports);
  if (arguments.output.empty()) print("Not written: give -o FILE.json\n");
}

// Throws std::runtime_error if there is no such file, or it may not be read.
void require_readable(const std::string& path) {
  if (path == "-" || std::ifstream(path)) return;
  throw std::runtime_error(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
}

}  // namespace

void add_fit(CLI::App& app) {
  CLI::App* command = app.add_subcommand("fit", "Learn a model from a table");
  command->footer("Example: llmt fit concrete.csv --target strength -o concrete.json");
  const auto arguments = std::make_shared<FitArguments>();
  add_learning_options(*command, arguments->learning);
  add_fit_options(*command, arguments->learning.options, arguments->learning.columns);
  add_output_file(*command, "-o,--output", arguments->output, "Model file to write", {readable_extension});
  command
      ->add_flag("--readable{15}", arguments->readable,
                 "Also the smallest crisp tree with short, rounded equations whose held-out error is at most this many "
                 "per cent above that of the best crisp tree [15]; written beside the model as NAME.readable.json")
      ->option_text("[=LOSS]");
  add_count(*command, "--readable-rules", arguments->readable_rules, Eigen::Index{1},
            "As --readable, but of its trees the one with the most rules up to this number", Eigen::Index{1000});
  command->add_flag("--teach", arguments->teach,
                    "Fit the tree to the answers of a sum of trees (--boost), on the rows and on rows made of them; "
                    "taken if its held-out error is smaller. Takes several times as long");
  add_number(
      *command, "--time-limit", arguments->time_limit, above_zero,
      "Seconds that the fit may take: the largest tree, or the sum of the most trees (--boost), that ends by then. "
      "The result names the size, and --max-leaves or --max-rounds makes the same model again. A readable tree "
      "and reports take their own time");
  add_report_options(*command, arguments->reports,
                     "predicted against observed (and FILE.importance.svg: what matters), with --lags runs over time");
  command->add_flag("--json", arguments->json, "Print the summary as JSON");
  command->add_flag("--stream", arguments->stream, "Learn row by row in constant memory");
  command->add_flag("--boost", arguments->boost,
                    "A sum of many small trees, each fitted to what those before it leave: more accurate than one tree "
                    "as a rule, and nobody reads it");
  add_count(*command, "--seeds", arguments->seeds, 1,
            "With --boost: the mean of this many sums, whose splits look at other features each. Two are about "
            "2 % more accurate in the mean of many tables; takes as many times as long",
            most_seeds);
  add_count(*command, "--max-rounds", arguments->max_rounds, 1,
            "With --boost: most trees of a target, before the sum is fitted to all rows with a quarter more [2000]");
  add_dynamic_options(*command, arguments->dynamic);
  add_arrow_fit_options(*command, arguments->arrow);
  require_forms(*command);
  command->callback([command, arguments] {
    if (is_arrow_file(arguments->learning.data) || !arguments->arrow.more.empty()) {
      ArrowFitArguments arrow = arguments->arrow;
      arrow.learning = arguments->learning;
      arrow.output = arguments->output;
      arrow.json = arguments->json;
      Processes alone;
      arrow_fit_command(*command, arrow, alone);
      return;
    }
    for (const char* option : {"--memory", "--checkpoint", "--resume"}) {
      if (command->count(option) == 0) continue;
      require_readable(arguments->learning.data);  // what is not there is no CSV file either
      throw std::invalid_argument(fmt::format("{}: {} is for Arrow files, and for several; llmt table makes one",
                                              arguments->learning.data, option));
    }
    require_target(arguments->learning);
    if (!arguments->dynamic.lags.empty()) {
      dynamic_fit_command(*command, {arguments->learning, arguments->dynamic, arguments->output, arguments->json,
                                     arguments->boost, !arguments->readable.empty(), arguments->reports});
      return;
    }
    refuse_dynamic_options(*command);
    if (arguments->stream) {
      stream_command(*command, {arguments->learning, arguments->output, arguments->json});
      return;
    }
    if (arguments->boost) {
      boost_command(*command, {arguments->learning, arguments->output, arguments->json, arguments->seeds,
                               arguments->max_rounds, arguments->time_limit});
      return;
    }
    for (const char* option : {"--seeds", "--max-rounds"}) {
      if (command->count(option) > 0) throw std::invalid_argument(fmt::format("{} is for --boost", option));
    }
    if (arguments->teach && arguments->time_limit > 0.0) {
      throw std::invalid_argument("--time-limit does not go with --teach, which fits a sum and a tree in every fold");
    }
    fit_command(*arguments);
  });
}

}  // namespace llmt::apps
