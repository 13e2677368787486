#include "report/robot/provenance.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "report/document/figures.hpp"

namespace llmt::report {

Json provenance_json(const robotics::Provenance& made) {
  Json json = {{"program", made.program}, {"date", made.date}, {"files", Json::array()}, {"options", made.options}};
  for (const robotics::SourceFile& file : made.sources) {
    json["files"].push_back({{"role", file.role}, {"name", file.name}, {"sha256", file.sha256}});
  }
  json["instrument"] = made.instrument.empty() ? Json(nullptr) : Json(made.instrument);
  json["serial_number"] = made.serial_number.empty() ? Json(nullptr) : Json(made.serial_number);
  return json;
}

robotics::Provenance provenance_of(const Json& json) {
  robotics::Provenance made{.program = json.at("program"), .date = json.at("date"), .sources = {}, .options = {}};
  for (const Json& file : json.at("files")) {
    made.sources.push_back({file.at("role"), file.at("name"), file.at("sha256")});
  }
  for (const Json& option : json.at("options")) made.options.push_back(option);
  const auto text_of = [](const Json& stated) { return stated.is_null() ? std::string() : stated.get<std::string>(); };
  made.instrument = text_of(json.at("instrument"));
  made.serial_number = text_of(json.at("serial_number"));
  return made;
}

std::vector<Section> provenance_section(const robotics::Robot& robot) {
  if (!robot.calibration || !robot.calibration->made_from) return {};
  const robotics::Provenance& made = *robot.calibration->made_from;
  std::vector<std::string> lines = {fmt::format("{}, {} (UTC)", made.program, made.date)};
  for (const robotics::SourceFile& file : made.sources) {
    lines.push_back(fmt::format("{}: {}, SHA-256 {}", file.role, file.name, file.sha256));
  }
  if (!made.options.empty()) lines.push_back(fmt::format("options: {}", fmt::join(made.options, " ")));
  if (!made.instrument.empty()) lines.push_back("instrument: " + made.instrument);
  if (!made.serial_number.empty()) lines.push_back("serial number of the robot: " + made.serial_number);
  return {{"What this was made from", "", {text_block("", lines)}}};
}

}  // namespace llmt::report
