#include "trees/command_simulation.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstring>
#include <stdexcept>

#include "llmt/csv.hpp"
#include "shared/child_process.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of(" \t\r\n");
  if (end == std::string::npos) return "";
  const std::size_t begin = text.rfind('\n', end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1,
                     end - (begin == std::string::npos ? 0 : begin + 1) + 1);
}

}  // namespace

Eigen::VectorXd CommandSimulation::nominal() const {
  Eigen::VectorXd values(std::ssize(parameters));
  for (std::size_t k = 0; k < parameters.size(); ++k) values(static_cast<Eigen::Index>(k)) = parameters[k].value;
  return values;
}

Eigen::MatrixXd CommandSimulation::run(const Eigen::MatrixXd& rows, const Eigen::VectorXd& values) const {
  std::vector<std::string> header;
  std::vector<std::string> given;
  for (const std::string& name : inputs) header.push_back(csv_field(name));
  std::string constant;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const double value = values(static_cast<Eigen::Index>(k));
    header.push_back(csv_field(parameters[k].name));
    constant += fmt::format(",{}", value);
    given.push_back(fmt::format("{} = {}", parameters[k].name, number(value)));
  }
  for (const LabelColumn& label : labels) header.push_back(csv_field(label.name));
  std::string table = fmt::format("{}\n", fmt::join(header, ","));
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Eigen::VectorXd row = rows.row(i);
    table += fmt::format("{}{}", fmt::join(row.begin(), row.end(), ","), constant);
    for (const LabelColumn& label : labels) {
      table += ',';
      table += csv_field(label.cells[i]);
    }
    table += '\n';
  }
  const std::string what = fmt::format("--simulate \"{}\" at {}", command, fmt::join(given, ", "));
  const ChildOutcome outcome = run_child(command, table, seconds);
  const auto fail = [&](const std::string& reason) {
    const std::string said = last_line(outcome.err);
    throw std::runtime_error(fmt::format("{}: {}{}", what, reason, said.empty() ? "" : "; it said: " + said));
  };
  if (outcome.timed_out) {
    fail(fmt::format("it did not end within {} s (--simulate-seconds), {} bytes written", seconds, outcome.out.size()));
  }
  if (outcome.overflowed) fail("it wrote too much");
  if (outcome.signal != 0)
    fail(fmt::format("it was ended by signal {} ({})", outcome.signal, ::strsignal(outcome.signal)));
  if (outcome.exit_code != 0) fail(fmt::format("it ended with exit code {}", outcome.exit_code));
  if (outcome.out.find_first_not_of(" \t\r\n") == std::string::npos) fail("it wrote nothing");
  const Csv csv = Csv::parse(outcome.out, what + ": its output");
  Eigen::MatrixXd result = csv.numbers(outputs);
  if (result.rows() != rows.rows()) fail(fmt::format("it wrote {} rows for {}", result.rows(), rows.rows()));
  return result;
}

}  // namespace llmt::apps
