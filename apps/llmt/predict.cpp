#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "llmt/commands.hpp"
#include "llmt/csv.hpp"
#include "llmt/files.hpp"
#include "llmt/fit.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

struct PredictArguments {
  std::string model;
  std::string data;
  std::string output;
  bool json = false;
  int threads = 0;
};

struct Predicted {
  std::vector<std::string> targets;
  Eigen::MatrixXd values;
  Eigen::VectorXd outside;
  /// RMSE of the targets that the table also holds, in the order of targets; NaN for the others.
  Eigen::VectorXd rmse;
};

/// Shortest text that reads back as the same number.
void append_number(std::string& text, double value) {
  char buffer[32];
  const std::to_chars_result end = std::to_chars(std::begin(buffer), std::end(buffer), value);
  text.append(buffer, end.ptr);
}

Predicted predict_table(const Model& model, const Csv& csv, int threads) {
  std::vector<std::string> inputs;
  for (const InputColumn& input : model.inputs()) {
    inputs.push_back(input.name);
  }
  const Eigen::MatrixXd values = csv.numbers(inputs);
  std::vector<std::string> targets;
  for (const OutputColumn& output : model.outputs()) {
    targets.push_back(output.name);
  }
  Predicted predicted{std::move(targets), model.predict(values, threads), model.outside(values),
                      Eigen::VectorXd::Constant(model.num_outputs(), std::nan(""))};
  for (std::size_t o = 0; o < predicted.targets.size(); ++o) {
    if (csv.has(predicted.targets[o]) && csv.rows() > 0) {
      const std::ptrdiff_t column = static_cast<std::ptrdiff_t>(o);
      try {
        predicted.rmse(column) = rmse(predicted.values.col(column), csv.numbers(predicted.targets[o]))(0);
      } catch (const std::runtime_error& error) {
        warn(fmt::format("llmt: no RMSE of \"{}\": {}", predicted.targets[o], error.what()));
      }
    }
  }
  return predicted;
}

/// The table as it came, with columns added.
std::string to_csv(const Csv& csv, const Predicted& predicted) {
  std::vector<std::string> added;
  for (const std::string& target : predicted.targets) {
    added.push_back(target + "_pred");
  }
  added.insert(added.end(), {"outside", "outside_by"});
  std::string text(csv.header_text());
  for (const std::string& column : added) {
    if (csv.has(column)) {
      throw std::runtime_error(
          fmt::format("{}: column \"{}\" is there already; remove or rename it", csv.name(), column));
    }
    text += csv.separator() + csv_field(column, csv.separator());
  }
  text += '\n';
  for (std::ptrdiff_t row = 0; row < csv.rows(); ++row) {
    text += csv.row_text(row);
    for (std::ptrdiff_t o = 0; o < predicted.values.cols(); ++o) {
      text += csv.separator();
      append_number(text, predicted.values(row, o));
    }
    text += csv.separator();
    text += predicted.outside(row) > 0.0 ? '1' : '0';
    text += csv.separator();
    append_number(text, predicted.outside(row));
    text += '\n';
  }
  return text;
}

Json summary_json(const Predicted& predicted, bool with_values) {
  Json json;
  json["rows"] = predicted.values.rows();
  json["outside_rows"] = (predicted.outside.array() > 0.0).count();
  json["targets"] = Json::array();
  for (std::size_t o = 0; o < predicted.targets.size(); ++o) {
    const std::ptrdiff_t column = static_cast<std::ptrdiff_t>(o);
    Json target = {{"name", predicted.targets[o]},
                   {"rmse", std::isnan(predicted.rmse(column)) ? Json(nullptr) : Json(predicted.rmse(column))}};
    if (with_values) {
      target["predicted"] =
          std::vector<double>(predicted.values.col(column).begin(), predicted.values.col(column).end());
    }
    json["targets"].push_back(std::move(target));
  }
  if (with_values) {
    json["outside_by"] = Json::array();
    for (const double distance : predicted.outside) {
      json["outside_by"].push_back(std::isfinite(distance) ? Json(distance) : Json("infinity"));
    }
  }
  return json;
}

void summarise(const PredictArguments& arguments, const Predicted& predicted) {
  const std::ptrdiff_t outside = (predicted.outside.array() > 0.0).count();
  std::string text = fmt::format("{}: {} rows predicted", arguments.data, predicted.values.rows());
  for (std::size_t o = 0; o < predicted.targets.size(); ++o) {
    const double error = predicted.rmse(static_cast<std::ptrdiff_t>(o));
    text += std::isnan(error) ? "" : fmt::format("; RMSE of {} {}", predicted.targets[o], number(error));
  }
  if (outside > 0) {
    text += fmt::format("; {} rows lie outside the training extent, by up to {} of an input's range", outside,
                        number(predicted.outside.maxCoeff(), 2));
  }
  warn(text);
}

void predict_command(const PredictArguments& arguments) {
  const Model model = load(arguments.model);
  const Csv csv = Csv::read(arguments.data);
  const Predicted predicted = predict_table(model, csv, arguments.threads);
  if (!arguments.output.empty()) {
    write_file(arguments.output, to_csv(csv, predicted));
  }
  if (arguments.json) {
    print_json(summary_json(predicted, arguments.output.empty()));
    return;
  }
  if (arguments.output.empty()) {
    print(to_csv(csv, predicted));
  }
  summarise(arguments, predicted);
}

}  // namespace

void add_predict(CLI::App& app) {
  CLI::App* command = app.add_subcommand("predict", "Apply a model to a table");
  command->description(
      "Apply a model to a table: the table's rows, in order, with a column TARGET_pred for every target; outside: 1 "
      "where an input lies\n"
      "outside its range in training; outside_by: how far, as a multiple of that range. If the table holds a target, "
      "its RMSE is reported.");
  command->footer("Example: llmt predict concrete.json new.csv -o predicted.csv");
  const auto arguments = std::make_shared<PredictArguments>();
  command->add_option("model", arguments->model, "Model file of llmt fit")->required();
  command->add_option("data", arguments->data, "CSV file with the model's inputs; other columns are passed through")
      ->required();
  command->add_option("-o,--output", arguments->output, "CSV file to write (default: standard output)");
  command->add_option("--threads", arguments->threads, "0: all; the result does not depend on it")
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print JSON; it holds the predictions unless -o is given");
  command->callback([arguments] { predict_command(*arguments); });
}

}  // namespace llmt::apps
