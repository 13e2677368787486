#include "trees/arrow_predict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <unordered_set>

#include "llmt/files.hpp"
#include "report/model/prediction.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/table_file.hpp"
#include "shared/table_files.hpp"
#include "trees/model_file.hpp"

namespace llmt::apps {
namespace {

// The model's inputs, of which the table must have those that the model uses.
class InputReader {
 public:
  InputReader(const TableFiles& table, const Model& model) : table_(table), inputs_(std::ssize(model.inputs())) {
    const std::vector<bool> used = used_inputs(model);
    const std::unordered_set<std::string> known(table.columns().begin(), table.columns().end());
    for (std::size_t j = 0; j < model.inputs().size(); ++j) {
      const InputColumn& input = model.inputs()[j];
      if (!used[j] && !known.contains(input.name)) continue;
      levels_.push_back(input.codes.empty() ? input.levels : std::vector<std::string>());
      names_.push_back(input.name);
      places_.push_back(static_cast<Eigen::Index>(j));
    }
    table.check_kinds(names_, levels_);
  }

  Eigen::MatrixXd read(Eigen::Index first, Eigen::Index count) const {
    Eigen::MatrixXd inputs = Eigen::MatrixXd::Constant(count, inputs_, std::numeric_limits<double>::quiet_NaN());
    inputs(Eigen::all, places_) = table_.read(first, count, names_, levels_);
    return inputs;
  }

 private:
  const TableFiles& table_;
  Eigen::Index inputs_;
  std::vector<std::string> names_;
  std::vector<std::vector<std::string>> levels_;
  std::vector<Eigen::Index> places_;
};

}  // namespace

void append_number(std::string& text, DecimalMark mark, double value) {
  char buffer[32];
  const std::to_chars_result end = std::to_chars(std::begin(buffer), std::end(buffer), value);
  std::replace(std::begin(buffer), end.ptr, '.', static_cast<char>(mark));
  text.append(buffer, end.ptr);
}

void predict_files(const PredictArguments& arguments) {
  const auto refuse = [](bool asked, const char* option) {
    if (!asked) return;
    throw std::invalid_argument(
        fmt::format("{} is not for Arrow files or several files; give the table as one CSV file", option));
  };
  refuse(arguments.json, "--json");
  refuse(arguments.interval > 0.0, "--interval");
  refuse(!arguments.quantiles.empty(), "--quantiles");
  const Model model = load_model(arguments.model, false).model;
  std::vector<std::string> files = {arguments.data};
  files.insert(files.end(), arguments.more.begin(), arguments.more.end());
  const TableFiles table(files, {arguments.mark, arguments.thousands});
  if (table.rows() == 0) throw std::runtime_error(fmt::format("{}: there are columns and no rows", table.name()));
  const InputReader reader(table, model);
  const std::string& target = model.outputs()[0].name;
  const bool has_target = std::ranges::find(table.columns(), target) != table.columns().end();
  if (has_target) table.require_numbers({target});
  double squares = 0.0;
  Eigen::Index compared = 0;
  const char separator = arguments.mark == DecimalMark::comma ? ';' : ',';
  const auto write = [&](const TextSink& sink) {
    std::string text;
    for (const OutputColumn& output : model.outputs()) text += csv_field(output.name + "_pred", separator) + separator;
    sink(text + fmt::format("outside{0}outside_by{0}leverage\n", separator));
    const Eigen::Index most = arrow_rows_at_once(model.inputs().size());
    for (Eigen::Index first = 0; first < table.rows(); first += most) {
      const Eigen::Index count = std::min(most, table.rows() - first);
      const Eigen::MatrixXd inputs = reader.read(first, count);
      const Eigen::MatrixXd values = model.predict(inputs, arguments.threads);
      const std::vector<Extrapolation> extrapolation = model.extrapolation(inputs, arguments.threads);
      if (has_target) {
        const Eigen::VectorXd errors = values.col(0) - table.read(first, count, {target}).col(0);
        compared += errors.size() - errors.array().isNaN().count();
        squares += errors.array().isNaN().select(0.0, errors).matrix().squaredNorm();
      }
      text.clear();
      for (Eigen::Index row = 0; row < count; ++row) {
        for (Eigen::Index o = 0; o < values.cols(); ++o) {
          append_number(text, arguments.mark, values(row, o));
          text += separator;
        }
        text += extrapolation[row].distance > 0.0 ? '1' : '0';
        for (const double number : {extrapolation[row].distance, extrapolation[row].leverage}) {
          text += separator;
          append_number(text, arguments.mark, number);
        }
        text += '\n';
      }
      sink(text);
    }
  };
  if (arguments.output.empty()) {
    write(print_bytes);
  } else {
    write_file(arguments.output, write);
  }
  warn(fmt::format("llmt: {} row{} of {}", table.rows(), table.rows() == 1 ? "" : "s", table.name()));
  if (!has_target) return;
  warn(compared == 0 ? fmt::format("llmt: no RMSE of \"{}\": it is missing in every row", target)
                     : fmt::format("llmt: RMSE of \"{}\"{}: {:.6g}", target,
                                   compared == table.rows() ? "" : fmt::format(" in {} rows that have it", compared),
                                   std::sqrt(squares / static_cast<double>(compared))));
}

}  // namespace llmt::apps
