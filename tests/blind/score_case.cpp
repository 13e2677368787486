#include "blind/score_case.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "llmt/robotics/calibration.hpp"
#include "llmt/robotics/robot_file.hpp"

namespace blind {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

Json read(const fs::path& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  return Json::parse(file);
}

bool generic(const std::string& family) { return family == "joint_map" || family == "joint_pair_map"; }

// Variants of one effect count as one name: drift_curved, joint_compliance_free_masses, "drift[35.2,3527.6]".
std::string family_of(std::string name) {
  name = name.substr(0, name.find_first_of("[@"));
  for (const char* family : {"joint_compliance", "transmission_error", "drift", "elastic_base", "tracker_knock",
                             "backlash_gravity", "hysteresis", "axis_wobble", "instrument_azimuth"}) {
    if (name.starts_with(family)) return family;
  }
  return name == "link_thermal_growth" ? "thermal_growth" : name;
}

// One thing under two names: no pose can tell them apart.
bool same_thing(const std::string& arm, const std::string& a, const std::string& a_at, const std::string& b,
                const std::string& b_at) {
  const auto ordered = [&](const std::string& x, const std::string& x_at, const std::string& y,
                           const std::string& y_at) {
    if (x == "counterbalance_spring" && y == "eccentricity") return x_at == y_at || x_at.empty() || y_at.empty();
    const bool planar = arm == "planar" || arm == "scara2";
    return planar && x == "elastic_base" && y == "joint_compliance" && (y_at == "joint1" || y_at.empty());
  };
  return ordered(a, a_at, b, b_at) || ordered(b, b_at, a, a_at);
}

bool alias(const Judged& c, const Truth& truth, const Named& named) {
  if (truth.locations.empty()) return same_thing(c.arm, truth.family, "", named.family, named.location);
  return std::ranges::any_of(truth.locations, [&](const std::string& at) {
    return same_thing(c.arm, truth.family, at, named.family, named.location);
  });
}

bool named_as(const Judged& c, const Truth& truth, const Named& named) {
  return named.family == truth.family || alias(c, truth, named);
}

bool in_class_of(const Judged& c, const Truth& truth, const Named& named) {
  return named_as(c, truth, named) || named.rivals.contains(truth.family) || named.aliases.contains(truth.family);
}

void read_truth(Judged& c, const Json& json) {
  c.name = json["case"];
  c.arm = json["arm"];
  c.kind = json["kind"];
  c.dirty = json["dirty"];
  c.lambda = json["lambda"];
  c.noise_mm = json["noise_mm"];
  c.poses = json["poses"];
  c.repeats = json["repeats"];
  c.elastic_description = json["elastic_description"];
  c.lambda_beyond_first_order = json["lambda_beyond_first_order"];
  for (const Json& h : json["hidden"]) {
    c.hidden.push_back({h["kind"], h["family"], h["in_catalogue"], h["locations"], h["lambda"]});
  }
  // Of two effects the smaller one decides what can be asked.
  for (const Truth& truth : c.hidden) c.lambda = std::min(c.lambda, truth.lambda);
  c.outliers_true = static_cast<int>(json["outlier_rows"].size());
}

void read_answer(Judged& c, const Json& json) {
  c.answered = true;
  c.verdict = json.value("verdict", "");
  for (const Json& effect : json.value("effects", Json::array())) {
    Named named;
    named.family = family_of(effect.value("name", ""));
    named.location = effect.value("location", "");
    named.confirmed = effect.value("confirmed", false) && !generic(named.family);
    for (const Json& rival : effect.value("rivals", Json::array())) {
      const std::string text = rival;
      const std::size_t at = text.find('@');
      const std::string family = family_of(text.substr(0, at));
      if (generic(family) || family == named.family) continue;
      const std::string place = at == std::string::npos ? "" : text.substr(at + 1);
      const bool same = same_thing(c.arm, named.family, named.location, family, place);
      (same ? named.aliases : named.rivals).insert(family);
    }
    if (c.first_name.empty() && named.confirmed) c.first_name = named.family;
    c.named.push_back(std::move(named));
  }
  if (c.first_name.empty()) c.first_name = c.verdict.starts_with("nothing") ? "(nothing)" : "(unknown)";
}

std::string place_of(const Judged& c, const Truth& truth) {
  std::set<std::string> said, real(truth.locations.begin(), truth.locations.end());
  for (const Named& named : c.named) {
    if (named.confirmed && named.family == truth.family) said.insert(named.location);
  }
  said.erase("");
  if (said.empty() && !real.empty()) return "other";
  if (said == real || real.empty()) return "same";
  if (std::ranges::includes(real, said)) return "subset";
  return std::ranges::includes(said, real) ? "superset" : "other";
}

void judge_names(Judged& c) {
  std::vector<Named> names;
  std::ranges::copy_if(c.named, std::back_inserter(names), &Named::confirmed);
  c.confirmed = static_cast<int>(names.size());
  c.missed = c.verdict.starts_with("nothing");
  c.false_alarm = c.hidden.empty() && !c.missed;
  for (const Named& named : names) c.class_size += (1.0 + static_cast<double>(named.rivals.size())) / c.confirmed;
  if (c.hidden.empty()) {
    c.extra = c.confidently_wrong = c.confirmed > 0;
    return;
  }
  c.right = c.in_class = true;
  for (const Truth& truth : c.hidden) {
    const auto any = [&](auto matches) {
      return std::ranges::any_of(names, [&](const Named& named) { return matches(c, truth, named); });
    };
    const bool exact = std::ranges::any_of(names, [&](const Named& n) { return n.family == truth.family; });
    c.right = c.right && any(named_as);
    c.by_alias = c.by_alias || (!exact && any(alias));
    c.in_class = c.in_class && any(in_class_of);
  }
  for (const Named& named : names) {
    const bool fits = std::ranges::any_of(c.hidden, [&](const Truth& t) { return in_class_of(c, t, named); });
    c.extra = c.extra || !fits;
  }
  // One effect: wrong if no name's class holds it. Two: wrong if some name's class holds neither.
  c.confidently_wrong = c.hidden.size() > 1 ? c.extra : c.confirmed > 0 && !c.in_class;
  if (c.right) c.place = place_of(c, c.hidden[0]);
}

// Values in SI units; no value if the unit is not known here.
std::optional<double> unit(std::string name) {
  std::erase_if(name, [](char ch) { return ch == ' ' || ch == '(' || ch == ')' || ch == '^' || ch == '*'; });
  static const std::map<std::string, double> units = {
      {"", 1},          {"1", 1},        {"-", 1},          {"rad", 1},        {"mrad", 1e-3},
      {"urad", 1e-6},   {"rad/Nm", 1},   {"mrad/Nm", 1e-3}, {"urad/Nm", 1e-6}, {"1/Nm2", 1},
      {"1/Nm²", 1},     {"mm", 1},       {"um", 1e-3},      {"kg", 1},         {"1/K", 1},
      {"um/m/K", 1e-6}, {"ppm/K", 1e-6}, {"rad/rad", 1},    {"ppm", 1e-6},     {"deg", 0.017453292519943295}};
  const auto found = units.find(name);
  if (found == units.end()) return std::nullopt;
  return found->second;
}

double constant_of(const Json& hidden, const std::string& name) {
  for (const Json& parameter : hidden["parameters"]) {
    if (parameter["name"] == name) return parameter["value"];
  }
  return 0.0;
}

// Only where truth and tool have exactly one number for one place, so that nothing is guessed; of a sine and a cosine
// the length counts.
void judge_coverage(Judged& c, const Json& truth, const Json& answer) {
  static const std::set<std::string> comparable = {"compliance", "flexibility", "torsion", "gain", "coupling",
                                                   "half_width", "amplitude",   "share",   "mass"};
  for (const Json& hidden : truth["hidden"]) {
    for (const Json& real : hidden["parameters"]) {
      const std::string name = real["name"];
      if (!comparable.contains(name)) continue;
      for (const Json& effect : answer.value("effects", Json::array())) {
        if (!effect.value("confirmed", false) || family_of(effect.value("name", "")) != hidden["family"]) continue;
        if (effect.value("location", "") != real["location"]) continue;
        // An overtone is another number than the wave itself.
        if (const double order = constant_of(hidden, "per_turn"); order > 0.0) {
          const double found = effect.value("constants", Json::object()).value("order_per_turn", order);
          if (std::abs(found - order) > 0.02 * order) continue;
        }
        double value = 0.0, variance = 0.0;
        std::size_t used = 0;
        const Json parameters = effect.value("parameters", Json::array());
        const bool by_name =
            std::ranges::any_of(parameters, [&](const Json& p) { return p.value("name", "") == name; });
        for (const Json& p : parameters) {
          if (by_name && p.value("name", "") != name) continue;
          const auto factor = unit(p.value("unit", ""));
          if (!factor || !p.contains("std_error") || !p["std_error"].is_number() || !p["value"].is_number()) continue;
          const double v = p["value"].get<double>() * *factor, e = p["std_error"].get<double>() * *factor;
          value = used == 0 ? v : std::hypot(value, v);
          variance = std::max(variance, e * e);
          ++used;
        }
        if (used == 0 || used > (name == "amplitude" ? 2u : 1u) || variance <= 0.0) continue;
        const double off = (value - real["value"].get<double>()) / std::sqrt(variance);
        c.coverage.push_back({hidden["family"].get<std::string>() + "." + name, std::abs(off) <= 1.96, off});
      }
    }
  }
}

double rms(const llmt::robotics::Robot& robot, const llmt::robotics::Measurements& fresh) {
  const Eigen::MatrixXd model = llmt::robotics::positions(robot, fresh.poses);
  return std::sqrt(llmt::robotics::distances(model, fresh).squaredNorm() / static_cast<double>(fresh.count()));
}

void judge_gap(Judged& c, const fs::path& folder, const fs::path& results) {
  using namespace llmt::robotics;
  const double noise = c.noise_mm * std::sqrt(c.arm == "planar" || c.arm == "scara2" ? 2.0 : 3.0);
  const Robot nominal = read_robot((folder / c.name / "robot.yaml").string());
  const std::string fresh = (folder / "truth" / (c.name + ".fresh.csv")).string();
  const Measurements measured = read_measurements((folder / c.name / "measured.csv").string(), nominal);
  c.before = rms(calibrate(nominal, measured).robot, read_measurements(fresh, nominal)) / noise;
  const fs::path improved = results / (c.name + ".yaml");
  if (!fs::exists(improved)) return;
  const Robot robot = read_robot(improved.string());
  c.after = rms(robot, read_measurements(fresh, robot)) / noise;
}

void judge_outliers(Judged& c, const Json& truth, const Json& answer) {
  std::set<int> real;
  for (const int row : truth["outlier_rows"]) real.insert(row);  // both count rows from 0
  for (const Json& one : answer.value("outliers", Json::array())) {
    const Json& row = one.is_object() && one.contains("row") ? one["row"] : one;
    if (row.is_number_integer()) ++(real.contains(row.get<int>()) ? c.outliers_found : c.outliers_wrong);
  }
}

}  // namespace

std::vector<std::string> cases(const std::string& folder) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(folder) / "truth")) {
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

Judged judge(const std::string& folder, const std::string& results, const std::string& name, bool gap) {
  Judged c;
  const Json truth = read(fs::path(folder) / "truth" / (name + ".json"));
  read_truth(c, truth);
  const fs::path path = fs::path(results) / (name + ".json");
  if (!fs::exists(path) || fs::file_size(path) == 0) return c;
  const Json answer = read(path);
  read_answer(c, answer);
  judge_names(c);
  judge_coverage(c, truth, answer);
  judge_outliers(c, truth, answer);
  if (gap) judge_gap(c, folder, results);
  std::ifstream time(fs::path(results) / (name + ".seconds"));
  double seconds = 0.0;
  if (time >> seconds) c.seconds = seconds;
  return c;
}

}  // namespace blind
