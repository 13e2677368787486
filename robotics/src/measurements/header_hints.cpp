#include <fmt/format.h>

#include <regex>
#include <set>

#include "measurements/header.hpp"

namespace llmt::robotics {

std::vector<Finding> Header::hints() const {
  struct Likeness {
    std::regex looks_like;
    const char* name;
  };
  static const std::vector<Likeness> known = {
      {std::regex("(target|smr|reflector|point|marker)([_ -]?(name|id|nr|no))?", std::regex::icase), "target"},
      {std::regex("(reference|ref|nest|(base|fixed)[_ -]?point)([_ -]?(name|id|nr|no))?", std::regex::icase),
       "reference"},
      {std::regex("(session|setup|station|series)([_ -]?(name|id|nr|no))?", std::regex::icase), "session"},
      {std::regex("(tau|torque|current|load)[_ -]?[0-9]+.*", std::regex::icase), "tau1_Nm, tau2_Nm, ..."},
      {std::regex("temp(erature)?([_ -].*)?|.*[_ -]temp(erature)?", std::regex::icase), "temp_C"},
      {std::regex("time([_ -]?stamp)?|timestamp", std::regex::icase), "time_s, in seconds"},
      {std::regex("payload|load([_ -]?kg)?|mass([_ -]?kg)?", std::regex::icase), "payload_kg"},
      {std::regex("(std|sigma|u95|uncertainty)([_ -]?[xyz])?([_ -]?(mm|um|m))?|.*[_ -](std|sigma|unc)([_ -]?[xyz])?",
                  std::regex::icase),
       "sigma_x_mm, sigma_y_mm, sigma_z_mm"},
  };
  std::map<std::string, std::string> seen;
  for (const std::string& column : unused_) {
    for (const Likeness& kind : known) {
      if (std::regex_match(column, kind.looks_like)) {
        // A date with its last digits lost says nothing of when a row was measured.
        const std::vector<std::string> cells = csv_.texts(column);
        const bool is_time = std::string(kind.name).starts_with("time_s");
        if (is_time && 2 * std::set<std::string>(cells.begin(), cells.end()).size() < cells.size()) break;
        seen.try_emplace(kind.name, column);
        break;
      }
    }
  }
  std::vector<Finding> hints;
  const auto add = [&](const char* code, const std::string& text) {
    hints.push_back({code, [name = csv_.name(), text](const Face& face) { return face.table(name) + ": " + text; }});
  };
  if (const std::string lack = lack_of_orientation(); !lack.empty()) add("lack_of_orientation", lack);
  for (const auto& [name, column] : seen) {
    const char last = column.back();
    const bool is_sigma = name.starts_with("sigma");
    const bool has_axis = last == 'x' || last == 'y' || last == 'z';
    const std::string own = !is_sigma ? name : has_axis ? fmt::format("sigma_{}_mm", last) : "sigma_mm";
    add("column_not_used",
        fmt::format("column \"{}\" is not used; if it is what it looks like, name it {}", column, own));
  }
  return hints;
}

std::string Header::lack_of_orientation() const {
  const auto count = [&](const std::vector<std::string>& names) {
    return std::ranges::count_if(names, [&](const std::string& name) { return quantities_.contains(name); });
  };
  const std::vector<std::string> angles = {"rx", "ry", "rz"};
  const std::vector<std::string> quaternion = {"qw", "qx", "qy", "qz"};
  for (const auto& names : {angles, quaternion}) {
    if (count(names) == 0 || count(names) == std::ssize(names)) continue;
    const auto lacking = std::ranges::find_if_not(names, [&](const auto& name) { return quantities_.contains(name); });
    return fmt::format("an orientation needs {}, there is no column {}", fmt::join(names, ", "), *lacking);
  }
  if (count(angles) > 0 && count(quaternion) > 0) return "there are angles and a quaternion, the angles are used";
  return {};
}

}  // namespace llmt::robotics
