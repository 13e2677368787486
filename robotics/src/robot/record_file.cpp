#include "robot/record_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "llmt/robotics/chain.hpp"

namespace llmt::robotics {
namespace {

std::vector<std::array<double, 2>> read_ranges(YamlMap& map, const Chain& chain) {
  std::vector<std::array<double, 2>> ranges;
  for (YamlMap entry : map.maps("joint_ranges", chain.joints.size())) {
    const Joint& joint = chain.joints[ranges.size()];
    if (entry.text("joint") != joint.name) entry.refuse("joint", fmt::format("\"joint\" must be {} here", joint.name));
    const std::string key = "range_" + limit_unit(joint);
    const std::vector<double> range = entry.numbers(key, 2);
    if (range[0] > range[1]) entry.refuse(key, fmt::format("\"{}\" has {} above {}", key, range[0], range[1]));
    ranges.push_back({range[0], range[1]});
    entry.finish({"joint", key});
  }
  if (ranges.size() == chain.joints.size()) return ranges;
  map.refuse("joint_ranges", fmt::format("there are {} ranges of {} joints", ranges.size(), chain.joints.size()));
}

std::map<std::string, std::array<double, 2>> read_conditions(YamlMap map) {
  std::map<std::string, std::array<double, 2>> ranges;
  for (const std::string& name : map.keys()) {
    const std::vector<double> range = map.numbers(name, 2);
    if (range[0] > range[1]) map.refuse(name, fmt::format("\"{}\" has {} above {}", name, range[0], range[1]));
    ranges[name] = {range[0], range[1]};
  }
  return ranges;
}

Provenance read_provenance(YamlMap map) {
  constexpr std::size_t most = 1000;
  Provenance made{.program = map.text("program"), .date = map.text("date"), .sources = {}, .options = {}};
  for (YamlMap entry : map.maps("files", most)) {
    made.sources.push_back({entry.text("role"), entry.text("name"), entry.text("sha256")});
    entry.finish({"role", "name", "sha256"});
  }
  if (map.has("options")) made.options = map.texts("options", most);
  made.instrument = map.text_or("instrument", "");
  made.serial_number = map.text_or("serial_number", "");
  map.finish({"program", "date", "files", "options", "instrument", "serial_number"});
  return made;
}

void write_ranges(YamlWriter& out, const Chain& chain, const CalibrationRecord& record) {
  out.key("joint_ranges").begin_list(YAML::Block);
  for (std::size_t j = 0; j < record.joint_ranges.size(); ++j) {
    const Joint& joint = chain.joints[j];
    out.begin_map().word("joint", joint.name).numbers("range_" + limit_unit(joint), record.joint_ranges[j]).end_map();
  }
  out.end_list();
}

void write_conditions(YamlWriter& out, const CalibrationRecord& record) {
  out.key("condition_ranges").begin_map(YAML::Flow);
  for (const auto& [name, range] : record.condition_ranges) out.numbers(name, range);
  out.end_map();
}

void write_provenance(YamlWriter& out, const Provenance& made) {
  out.key("made_from").begin_map(YAML::Block).word("program", made.program).word("date", made.date);
  out.key("files").begin_list(YAML::Block);
  for (const SourceFile& source : made.sources) {
    out.begin_map().word("role", source.role).word("name", source.name).word("sha256", source.sha256).end_map();
  }
  out.end_list();
  if (!made.options.empty()) out.key("options").words(made.options);
  if (!made.instrument.empty()) out.word("instrument", made.instrument);
  if (!made.serial_number.empty()) out.word("serial_number", made.serial_number);
  out.end_map();
}

}  // namespace

// The lower triangle by rows makes a matrix of the identified parameters that have a standard error.
CalibrationRecord read_record(YamlMap map, const Robot& robot) {
  CalibrationRecord record;
  const auto count = [&](const char* key) {
    const double value = map.number(key);
    constexpr double most = 1e9;
    if (!(value >= 1.0 && value <= most)) map.refuse(key, fmt::format("\"{}\" is {}, must be >= 1", key, value));
    return static_cast<Eigen::Index>(value);
  };
  record.poses = count("poses");
  record.coordinates = map.has("coordinates") ? count("coordinates") : 3 * record.poses;
  const auto not_negative = [&](const char* key) {
    const double value = map.number(key);
    if (value < 0.0) map.refuse(key, fmt::format("\"{}\" is {}, must be >= 0", key, value));
    return value;
  };
  record.noise_mm = not_negative("noise_mm");
  if (map.has("held_out_mm")) record.held_out_mm = not_negative("held_out_mm");
  if (map.has("held_out_sd_mm")) record.held_out_sd_mm = not_negative("held_out_sd_mm");
  if (map.has("held_out_poses")) record.held_out_poses = count("held_out_poses");
  if (map.has("made_from")) record.made_from = read_provenance(map.map("made_from"));
  if (map.has("joint_ranges")) record.joint_ranges = read_ranges(map, robot.chain);
  if (map.has("condition_ranges")) record.condition_ranges = read_conditions(map.map("condition_ranges"));
  const auto known =
      std::ranges::count_if(robot.identified, [](const auto& entry) { return entry.standard_error.has_value(); });
  if (map.has("correlations")) {
    const std::vector<double> below = map.numbers("correlations", static_cast<std::size_t>(known * (known - 1) / 2));
    record.correlations = Eigen::MatrixXd::Identity(known, known);
    auto next = below.begin();
    for (Eigen::Index i = 0; i < known; ++i) {
      for (Eigen::Index k = 0; k < i; ++k, ++next) {
        if (std::abs(*next) > 1.0)
          map.refuse("correlations", fmt::format("a correlation is {}, must be -1 ... 1", *next));
        record.correlations(i, k) = record.correlations(k, i) = *next;
      }
    }
  }
  map.finish({"poses", "coordinates", "noise_mm", "held_out_mm", "held_out_sd_mm", "held_out_poses", "made_from",
              "joint_ranges", "condition_ranges", "correlations"});
  return record;
}

void write_record(YamlWriter& out, const Chain& chain, const CalibrationRecord& record) {
  out.key("calibration").begin_map(YAML::Block);
  out.number("poses", static_cast<double>(record.poses))
      .number("coordinates", static_cast<double>(record.coordinates))
      .number("noise_mm", record.noise_mm);
  if (record.held_out_mm) out.number("held_out_mm", *record.held_out_mm);
  if (record.held_out_sd_mm) out.number("held_out_sd_mm", *record.held_out_sd_mm);
  if (record.held_out_poses > 0) out.number("held_out_poses", static_cast<double>(record.held_out_poses));
  if (record.made_from) write_provenance(out, *record.made_from);
  if (!record.joint_ranges.empty()) write_ranges(out, chain, record);
  if (!record.condition_ranges.empty()) write_conditions(out, record);
  std::vector<double> below;
  for (Eigen::Index i = 0; i < record.correlations.rows(); ++i) {
    for (Eigen::Index k = 0; k < i; ++k) below.push_back(record.correlations(i, k));
  }
  if (!below.empty()) out.numbers("correlations", below);
  out.end_map();
}

}  // namespace llmt::robotics
