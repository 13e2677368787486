#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>

#include "llmt/arrow.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/csv.hpp"
#include "llmt/files.hpp"
#include "llmt/fit.hpp"
#include "llmt/intervals.hpp"
#include "report/model/prediction.hpp"
#include "report/table/columns.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/table_file.hpp"
#include "trees/arrow_predict.hpp"
#include "trees/commands.hpp"
#include "trees/model_file.hpp"

namespace llmt::apps {
namespace {

// The part of the predictions that trees and sums of trees have in common.
template <class AnyModel>
report::Prediction predict_values(const PredictArguments& arguments, const AnyModel& model,
                                  const report::ModelInputs& inputs) {
  report::Prediction predicted;
  for (const OutputColumn& output : model.outputs()) {
    predicted.targets.push_back(output.name);
  }
  predicted.values = model.predict(inputs.values, arguments.threads);
  predicted.missing = inputs.missing;
  predicted.unknown = inputs.unknown;
  predicted.unseen_codes = inputs.unseen_codes;
  return predicted;
}

void add_errors(const PredictArguments& arguments, const Csv& csv, report::Prediction& predicted) {
  predicted.rmse = Eigen::VectorXd::Constant(std::ssize(predicted.targets), std::nan(""));
  for (std::size_t o = 0; o < predicted.targets.size(); ++o) {
    if (csv.has(predicted.targets[o]) && csv.rows() > 0) {
      const Eigen::Index column = o;
      try {
        predicted.rmse(column) =
            rmse(predicted.values.col(column), csv.numbers(predicted.targets[o], arguments.threads))(0);
      } catch (const std::runtime_error& error) {
        warn(fmt::format("llmt: no RMSE of \"{}\": {}", predicted.targets[o], error.what()));
      }
    }
  }
}

bool asks_for_intervals(const PredictArguments& arguments) {
  return arguments.interval > 0.0 || !arguments.quantiles.empty();
}

// The intervals and quantiles that are asked for.
void add_intervals(const PredictArguments& arguments, const BoostedModel& model, const Eigen::MatrixXd& inputs,
                   const Eigen::VectorXd& weights, report::Prediction& predicted) {
  if (!model.has_intervals()) {
    throw std::runtime_error(fmt::format("{}: the file has no held-out residuals; fit again", arguments.model));
  }
  if (arguments.interval > 0.0) {
    predicted.bounds = model.intervals(inputs, arguments.interval, arguments.threads, weights);
  }
  if (!arguments.quantiles.empty()) {
    predicted.quantiles = quantiles(model, inputs, arguments.quantiles, arguments.threads, weights);
  }
}

void add_intervals(const PredictArguments& arguments, const ModelWithIntervals& file, const Eigen::MatrixXd& inputs,
                   const Eigen::VectorXd& weights, report::Prediction& predicted) {
  if (file.intervals.empty()) {
    throw std::runtime_error(fmt::format(
        "{}: the file has no held-out residuals; fit without --no-intervals and with folds", arguments.model));
  }
  if (arguments.interval > 0.0) {
    predicted.bounds =
        holding(file.intervals.predict(inputs, arguments.interval, arguments.threads, weights), predicted.values);
  }
  if (!arguments.quantiles.empty()) {
    predicted.quantiles = quantiles(file, inputs, arguments.quantiles, arguments.threads, weights);
  }
}

// What cannot be had is the file's fault, not the caller's: it has too few residuals for the level.
template <class AnyModel>
void add_asked_intervals(const PredictArguments& arguments, const AnyModel& model, const Csv& csv,
                         const Eigen::MatrixXd& inputs, report::Prediction& predicted) {
  if (!asks_for_intervals(arguments)) return;
  const Eigen::VectorXd weights =
      arguments.weight.empty() ? Eigen::VectorXd() : positive_weights(csv, arguments.weight, arguments.threads);
  predicted.probabilities = arguments.quantiles;
  try {
    add_intervals(arguments, model, inputs, weights, predicted);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", arguments.model, error.what()));
  }
}

report::Prediction predict_table(const PredictArguments& arguments, const BoostedModel& model, const Csv& csv) {
  const report::ModelInputs inputs = report::read_inputs(csv, model, arguments.threads);
  report::Prediction predicted = predict_values(arguments, model, inputs);
  predicted.has_leverage = false;
  for (const double distance : distance_outside(model, inputs.values)) predicted.extrapolation.push_back({distance});
  add_asked_intervals(arguments, model, csv, inputs.values, predicted);
  if (predicted.bounds) predicted.bounds->uncalibrated = incomplete_rows(model, inputs.values);
  add_errors(arguments, csv, predicted);
  return predicted;
}

report::Prediction predict_table(const PredictArguments& arguments, const ModelWithIntervals& file, const Csv& csv) {
  const Model& model = file.model;
  const report::ModelInputs inputs = report::read_inputs(csv, model, arguments.threads);
  report::Prediction predicted = predict_values(arguments, model, inputs);
  predicted.extrapolation = model.extrapolation(inputs.values, arguments.threads);
  add_asked_intervals(arguments, file, csv, inputs.values, predicted);
  add_errors(arguments, csv, predicted);
  return predicted;
}

// The table as it came, with columns added; piece by piece, because the table is in memory already.
void write_csv(const Csv& csv, const report::Prediction& predicted, const TextSink& sink) {
  std::vector<std::string> added;
  for (const std::string& target : predicted.targets) {
    added.push_back(target + "_pred");
    if (predicted.bounds) {
      added.insert(added.end(), {target + "_low", target + "_high"});
    }
    for (const double p : predicted.probabilities) added.push_back(fmt::format("{}_q{}", target, p));
  }
  added.insert(added.end(), {"outside", "outside_by"});
  if (predicted.bounds) added.emplace_back("in_gap");
  if (predicted.has_leverage) added.emplace_back("leverage");
  std::string text(csv.header_text());
  for (const std::string& column : added) {
    if (csv.has(column)) {
      throw std::runtime_error(
          fmt::format("{}: column \"{}\" is there already; remove or rename it", csv.name(), column));
    }
    text += csv.separator() + csv_field(column, csv.separator());
  }
  text += '\n';
  for (Eigen::Index row = 0; row < csv.rows(); ++row) {
    text += csv.row_text(row);
    for (Eigen::Index o = 0; o < predicted.values.cols(); ++o) {
      text += csv.separator();
      append_number(text, csv.decimal_mark(), predicted.values(row, o));
      if (predicted.bounds) {
        text += csv.separator();
        append_number(text, csv.decimal_mark(), predicted.bounds->lower(row, o));
        text += csv.separator();
        append_number(text, csv.decimal_mark(), predicted.bounds->upper(row, o));
      }
      for (Eigen::Index k = 0; k < std::ssize(predicted.probabilities); ++k) {
        text += csv.separator();
        append_number(text, csv.decimal_mark(), predicted.quantiles[static_cast<std::size_t>(o)](row, k));
      }
    }
    const Extrapolation& extrapolation = predicted.extrapolation[row];
    text += csv.separator();
    text += extrapolation.distance > 0.0 ? '1' : '0';
    text += csv.separator();
    append_number(text, csv.decimal_mark(), extrapolation.distance);
    if (predicted.bounds) {
      text += csv.separator();
      text += std::ranges::binary_search(predicted.bounds->in_gap, row) ? '1' : '0';
    }
    if (predicted.has_leverage) {
      text += csv.separator();
      append_number(text, csv.decimal_mark(), extrapolation.leverage);
    }
    text += '\n';
    if (constexpr std::size_t piece = 1 << 16; text.size() >= piece) {
      sink(text);
      text.clear();
    }
  }
  sink(text);
}

report::Prediction predict_file(const PredictArguments& arguments, std::optional<Csv>& csv) {
  const auto read = [&] {
    csv.emplace(read_table(arguments.data, arguments.mark, arguments.thousands));
    if (csv->rows() == 0) throw std::runtime_error(fmt::format("{}: there is a header and no rows", csv->name()));
  };
  if (is_boosted_file(arguments.model)) {
    const BoostedModel model = load_boosted(arguments.model);
    read();
    return predict_table(arguments, model, *csv);
  }
  const ModelWithIntervals file =
      read_unless_exchanged(arguments.model, arguments.data, model_comes_first,
                            [&](const std::string& path) { return load_model(path, asks_for_intervals(arguments)); });
  read();
  return predict_table(arguments, file, *csv);
}

void predict_command(const PredictArguments& arguments) {
  levels_of_quantiles(arguments.quantiles);  // throws if they do not ascend
  if (!arguments.weight.empty() && !asks_for_intervals(arguments)) {
    throw std::invalid_argument("--weight says how wide intervals are; give --interval or --quantiles too");
  }
  if (is_arrow_file(arguments.data) || !arguments.more.empty()) {
    predict_files(arguments);
    return;
  }
  std::optional<Csv> csv;
  const report::Prediction predicted = predict_file(arguments, csv);
  if (const Eigen::Index count = report::count_not_finite(predicted); count > 0) {
    warn(fmt::format("llmt: warning: {} of {} predictions are not finite: numbers of {} are too large for these rows",
                     count, predicted.values.size(), arguments.model));
  }
  if (!arguments.output.empty()) {
    write_file(arguments.output, [&](const TextSink& sink) { write_csv(*csv, predicted, sink); });
  }
  if (arguments.json) {
    print_json(report::prediction_json(predicted, arguments.output.empty()));
    return;
  }
  if (arguments.output.empty()) {
    write_csv(*csv, predicted, print_bytes);
  }
  warn(report::prediction_text(predicted, table_name(arguments.data)));
}

}  // namespace

void add_predict(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "predict",
      "Apply a model to a table\n"
      "Writes the table's rows, in order, with more columns. TARGET_pred: the prediction. outside: 1 where an input "
      "lies outside its range in training. outside_by: how far, as a multiple of that range. leverage: of the row on "
      "its local models; 1 and more: far from the rows of its leaf (not of a boosted model). If the table holds a "
      "target, its RMSE "
      "is reported.");
  command->footer("Example: llmt predict concrete.json new.csv -o predicted.csv");
  const auto arguments = std::make_shared<PredictArguments>();
  add_input_file(*command, "model", arguments->model, "Model file of llmt fit")->required();
  add_input_file(*command, "data", arguments->data,
                 "CSV or Arrow file with the model's inputs; other columns of one CSV file are passed through; - is "
                 "standard input")
      ->required();
  add_input_files(*command, "more", arguments->more, "Further files of the same table, Arrow or CSV");
  add_output_file(*command, "-o,--output", arguments->output, "CSV file to write [standard output]");
  constexpr NumberRange level = {0.01, 0.9999, "a number from 0.01 to 0.9999"};
  add_number(*command, "--interval", arguments->interval, level,
             "Level of prediction intervals, such as 0.9: adds TARGET_low, TARGET_high and in_gap, 1 where a row lies "
             "among training rows that leave its place empty");
  constexpr NumberRange probability = {0.0001, 0.9999, "numbers from 0.0001 to 0.9999, ascending"};
  add_numbers(*command, "--quantiles", arguments->quantiles, probability,
              "Probabilities such as 0.05,0.5,0.95: adds TARGET_q0.05 and so on, values below which that share of new "
              "rows lies");
  command
      ->add_option("--weight", arguments->weight,
                   "The rows' weights, for --interval and --quantiles of a model that was fitted with --weight [the "
                   "median weight of the fit]")
      ->type_name("COLUMN");
  add_decimal_comma(*command, arguments->mark);
  add_thousands(*command, arguments->thousands);
  add_threads(*command, arguments->threads);
  command->add_flag("--json", arguments->json, "Print JSON; it holds the predictions unless -o is given");
  command->callback([arguments] { predict_command(*arguments); });
}

}  // namespace llmt::apps
