// Every limit of llmt/limits.hpp is asked just below and just above. A limit without a case does not compile.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/arrow_limits.hpp"
#include "apps/programs.hpp"
#include "apps/robot_limits.hpp"
#include "llmt/csv.hpp"
#include "llmt/distributed.hpp"
#include "llmt/files.hpp"
#include "llmt/fit.hpp"
#include "llmt/limits.hpp"
#include "llmt/model.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "oracles/chains.hpp"
#include "oracles/hard_sums.hpp"

namespace {

using limits::numbered;
using limits::times;
using llmt::Limit;
using program::Folder;

// A file of this number of bytes that takes no room on the disk.
std::string sparse(const Folder& folder, std::int64_t bytes) {
  const std::string path = folder.write("sparse", "");
  std::filesystem::resize_file(path, bytes);
  return path;
}

void fit_magnitude(double input, double output, llmt::LocalTerms terms) {
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(30, -input, input);
  const Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(30, -output, output);
  llmt::FitOptions options;
  options.terms = terms;
  llmt::fit({.inputs = x, .outputs = y}, options);
}

std::vector<std::string> levels(std::int64_t count) {
  std::vector<std::string> names;
  for (std::int64_t k = 0; k < count; ++k) names.push_back(std::to_string(k));
  return names;
}

// A chain whose first splits take a level of each of ten inputs away. The boxes of all later leaves list the others.
constexpr int num_categorical = 10;
constexpr int others = 9999;
constexpr int of_a_box = num_categorical * others;
constexpr int of_first_boxes = num_categorical + others * num_categorical * (num_categorical - 1) / 2;

void list_boxes(std::int64_t sides) {
  const auto splits = static_cast<int>((sides - of_first_boxes) / of_a_box) + num_categorical;
  const llmt::Model chain = oracle::chain(splits + 1, llmt::ValidityKind::crisp, 0.0);
  std::vector<llmt::InputColumn> columns = chain.inputs();
  llmt::Partition partition = chain.partitions().front();
  for (int k = 0; k < num_categorical; ++k) {
    columns.push_back({.name = std::to_string(k), .low = 0.0, .high = others, .levels = levels(others + 1)});
    llmt::Node& node = partition.nodes[std::max(0, 2 * k - 1)];
    node.split_input = 2 + k;
    node.level_side.assign(others + 1, -1);
    node.level_side.back() = 1;
  }
  llmt::Model(columns, chain.outputs(), chain.regressors(), {partition}).leaves(0);
}

void run(const Folder& folder, const std::string& command) {
  const program::Outcome outcome = folder.run(command);
  if (outcome.exit_code != 0) throw std::runtime_error(outcome.err);
}

void write_through_links(const Folder& folder, std::int64_t links) {
  folder.write("link0", "");
  for (std::int64_t k = 1; k <= links; ++k) {
    std::filesystem::create_symlink(fmt::format("link{}", k - 1), folder.file(fmt::format("link{}", k)));
  }
  llmt::write_file(folder.file(fmt::format("link{}", links)), "content");
}

// A message of this number of bytes, without its line break.
void say(const Folder& folder, std::int64_t bytes) {
  folder.write("t.csv", "a,b\n1,2\n");
  const auto message = [&](std::int64_t letters) {
    return folder.run(fmt::format("{} fit t.csv -t {}", program::llmt_program, std::string(letters, 'x'))).err;
  };
  const std::int64_t around = std::ssize(message(1)) - 2;
  throw std::runtime_error(message(bytes - around));
}

// Asks for `size` of what the limit bounds, and throws what the reader throws.
void ask(Limit limit, double size) {
  const Folder folder;
  const auto count = static_cast<std::int64_t>(size);
  switch (limit) {
    case Limit::table_line:
      llmt::Csv::read(folder.write("t.csv", "a\n" + std::string(count, '1') + "\n"));
      return;
    case Limit::arrow_metadata:
    case Limit::arrow_columns:
    case Limit::arrow_batches:
    case Limit::arrow_word:
      arrow_limits::ask(folder, limit, count);
      return;
    case Limit::magnitude:
      fit_magnitude(1.0, size, llmt::LocalTerms::linear);
      fit_magnitude(size, 1.0, llmt::LocalTerms::linear);
      return;
    case Limit::quadratic_magnitude:
      fit_magnitude(size, 1.0, llmt::LocalTerms::quadratic);
      return;
    case Limit::categories:
      llmt::Model({{.name = "a", .low = 0.0, .high = 1.0, .levels = levels(count)}}, {{.name = "y"}}, {}, {});
      return;
    case Limit::categories_beyond_memory:
      llmt::distributed::start({"a"}, "y", {.levels = {levels(count)}});
      return;
    case Limit::model_bytes:
      llmt::load(sparse(folder, count));
      return;
    case Limit::model_values:
      llmt::from_json("[" + times(count - 2, "0,") + "0]");
      return;
    case Limit::json_levels:
      llmt::from_json(std::string(count, '[') + std::string(count, ']'));
      return;
    case Limit::json_members:
      llmt::from_json("{" + numbered(count - 1, "\"{}\":0,") + "\"last\":0}");
      return;
    case Limit::model_splits_above_leaf:
      oracle::chain(static_cast<int>(count) + 1, llmt::ValidityKind::crisp, 0.0);
      return;
    case Limit::listed_sides:
      list_boxes(count);
      return;
    case Limit::sum_leaf_slopes:
      oracle::leaf_of_slopes(count);
      return;
    case Limit::sum_trials:
      oracle::explain_counting_leaf(count);
      return;
    case Limit::description_bytes:
      llmt::robotics::read_robot(sparse(folder, count));
      return;
    case Limit::yaml_nodes:  // the map, its key, the list, and as many values
      llmt::robotics::parse_robot("a: [" + times(count - 3, "0,") + "]", "r");
      return;
    case Limit::expression_characters:
      limits::read_mechanism("", limits::any_joint, "'" + std::string(count - 5, ' ') + "q = 0'");
      return;
    case Limit::mechanism_parameters:
      limits::read_mechanism(numbered(count, "{{name: p{}, value: 1}},"), limits::any_joint, "q = 0");
      return;
    case Limit::mechanism_coordinates:
      limits::read_mechanism("", numbered(count, "{{name: q{}, start_deg: 0, limits_deg: [-9, 9]}},"), "q0 = 0");
      return;
    case Limit::mechanism_equations:
      limits::read_mechanism("", limits::any_joint, times(count, "q = 0,"));
      return;
    case Limit::robot_joints:
      limits::read_robot(count, "");
      return;
    case Limit::robot_effects:
      limits::read_robot(1, limits::effects(count, 1));
      return;
    case Limit::robot_effect_values:
      limits::read_robot(1, limits::effects(10, count / 10) + times(count % 10, limits::one_more));
      return;
    case Limit::urdf_levels:  // within the robot
      limits::read_urdf("", times(count - 1, "<a>") + times(count - 1, "</a>"));
      return;
    case Limit::urdf_attributes:
      limits::read_urdf("", "<a " + numbered(count, "x{}=\"\" ") + "/>");
      return;
    case Limit::urdf_nodes:  // seven are there
      limits::read_urdf("", times(count - 7, "<a/>"));
      return;
    case Limit::urdf_links:  // two are there
      limits::read_urdf(
          numbered(count - 2, "<link name=\"k{0}\"/>"),
          numbered(count - 2,
                   "<joint name=\"j{0}\" type=\"fixed\"><parent link=\"a\"/><child link=\"k{0}\"/></joint>"));
      return;
    case Limit::simulated_poses:
      run(folder, fmt::format("{} simulate /dev/null --poses {} -o p.csv", program::robot_program, count));
      return;
    case Limit::symbolic_links:
      write_through_links(folder, count);
      return;
    case Limit::message_bytes:
      say(folder, count);
      return;
  }
}

// A part of the message beyond the limit.
std::string refusal(Limit limit) {
  switch (limit) {
    case Limit::table_line:
      return "no line ends within 16 MiB";
    case Limit::arrow_metadata:
    case Limit::arrow_columns:
    case Limit::arrow_batches:
    case Limit::arrow_word:
      return arrow_limits::refusal(limit);
    case Limit::magnitude:
      return "at most 1e150";
    case Limit::quadratic_magnitude:
      return "at most 1e70";
    case Limit::categories:
      return "10001 levels, at most 10000 are possible";
    case Limit::categories_beyond_memory:
      return "has 256 categories, 255 are possible";
    case Limit::model_bytes:
      return "it holds more than 256 MiB";
    case Limit::model_values:
      return "more than 16777216 values";
    case Limit::json_levels:
      return "more than 32 levels";
    case Limit::json_members:
      return "more than 100 members";
    case Limit::model_splits_above_leaf:
      return "deeper than 2000 splits";
    case Limit::listed_sides:
      return "too many to be listed";
    case Limit::sum_leaf_slopes:
      return "more than 12 slopes";
    case Limit::sum_trials:
      return "more than 10000 trials";
    case Limit::description_bytes:
      return "it holds more than 16 MiB";
    case Limit::yaml_nodes:
      return "more than 300000 keys, values and lists";
    case Limit::expression_characters:
      return "10001 characters, at most 10000 are read";
    case Limit::mechanism_parameters:
      return "has 1001 entries, at most 1000 are read";
    case Limit::mechanism_coordinates:
      return "has 101 entries, at most 100 are read";
    case Limit::mechanism_equations:
      return "has 201 entries, at most 200 are read";
    case Limit::robot_joints:
      return "101";
    case Limit::robot_effects:
      return "1001";
    case Limit::robot_effect_values:
      return "have 10001 values up to here, at most 10000 are possible";
    case Limit::urdf_levels:
      return "nested deeper than 100";
    case Limit::urdf_attributes:
      return "more than 100 attributes";
    case Limit::urdf_nodes:
      return "more than 300000 elements and comments";
    case Limit::urdf_links:
      return "more than 5000 links";
    case Limit::simulated_poses:
      return "it must be a whole number from 1 to 1000000";
    case Limit::symbolic_links:
      return "Too many levels of symbolic links";
    case Limit::message_bytes:
      return " bytes) ... ";
  }
  return "";
}

std::string message(Limit limit, double size) {
  try {
    ask(limit, size);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

class EachLimit : public testing::TestWithParam<llmt::LimitRow> {};

TEST_P(EachLimit, IsTakenAndOneMoreIsRefused) {
  const llmt::LimitRow& row = GetParam();
  const double beyond = row.unit == llmt::LimitUnit::power
                            ? std::nextafter(row.most, std::numeric_limits<double>::infinity())
                            : row.most + 1.0;
  const bool has_steps = row.limit == Limit::listed_sides || row.limit == Limit::sum_trials;
  EXPECT_EQ(message(row.limit, row.most).find(refusal(row.limit)), std::string::npos) << message(row.limit, row.most);
  const std::string refused = message(row.limit, beyond + (has_steps ? of_a_box : 0.0));
  EXPECT_NE(refused.find(refusal(row.limit)), std::string::npos) << refused.substr(0, 300);
}

INSTANTIATE_TEST_SUITE_P(Limits, EachLimit, testing::ValuesIn(llmt::limit_table),
                         [](const auto& row) { return fmt::format("Row{}", row.index); });

std::string amount(const llmt::LimitRow& row) {
  if (row.unit == llmt::LimitUnit::bytes) return fmt::format("{} MiB", row.most / (1 << 20));
  if (row.unit == llmt::LimitUnit::power) return fmt::format("1e{:g}", std::log10(row.most));
  std::string digits = fmt::format("{}", row.most);
  for (std::ptrdiff_t at = std::ssize(digits) - 3; at > 0 && digits.size() > 4; at -= 3) digits.insert(at, " ");
  return digits;
}

TEST(Limits, TheThreatModelPrintsTheTable) {
  std::string table;
  for (const llmt::LimitRow& row : llmt::limit_table) {
    table += fmt::format("| {} | {} | {} |\n", row.what, amount(row), row.beyond);
  }
  const std::string page = llmt::read_file(LLMT_ROOT "/docs/threat-model.md");
  EXPECT_NE(page.find(table), std::string::npos) << "docs/threat-model.md must have these lines:\n" << table;
}

}  // namespace
