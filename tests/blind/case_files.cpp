#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "blind/case.hpp"

namespace blind {
namespace {

using Json = nlohmann::ordered_json;

void save(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

Json truth(const Case& c) {
  Json json = {{"case", c.order.name()},
               {"arm", c.order.arm},
               {"kind", c.order.kind},
               {"dirty", c.order.dirty},
               {"seed", c.order.seed},
               {"noise_mm", c.noise_mm},
               {"lambda", c.lambda},
               {"poses", c.options.poses},
               {"rows", c.measured_mm.rows()},
               {"payloads", c.options.two_payloads ? 2 : 1},
               {"repeats", c.options.repeats},
               {"elastic_description", !c.elastic_joints.empty()},
               {"outlier_rows", c.outliers},
               {"deflection_mm", c.deflection_mm},
               {"lambda_beyond_first_order", c.lambda_beyond_first_order}};
  json["hidden"] = Json::array();
  for (const HiddenShare& share : c.hidden) {
    Json one = {{"kind", share.effect.kind},
                {"family", family(share.effect.kind)},
                {"in_catalogue", in_catalogue(share.effect.kind)},
                {"locations", share.effect.locations},
                {"lambda", share.lambda},
                {"lambda_beyond_other", share.lambda_beyond_other},
                {"rms_mm", share.rms_mm},
                {"parameters", Json::array()}};
    for (const TrueParameter& p : share.effect.parameters) {
      one["parameters"].push_back({{"name", p.name}, {"location", p.location}, {"value", p.value}, {"unit", p.unit}});
    }
    json["hidden"].push_back(std::move(one));
  }
  return json;
}

}  // namespace

std::string to_csv(const Session& s, const Eigen::MatrixXd& points_mm, bool planar, bool repeats) {
  const Eigen::Index joints = s.q.cols(), axes = planar ? 2 : 3;
  std::string text;
  for (Eigen::Index j = 1; j <= joints; ++j) text += fmt::format("q{}_rad,", j);
  text += planar ? "x_mm,y_mm," : "x_mm,y_mm,z_mm,";
  text += "payload_kg,temp_C,time_s,order";
  for (Eigen::Index j = 1; j <= joints; ++j) text += fmt::format(",dir{}", j);
  for (Eigen::Index j = 1; j <= joints; ++j) text += fmt::format(",qmeas{}_rad", j);
  text += repeats ? ",pose,returned\n" : "\n";
  for (Eigen::Index i = 0; i < s.count(); ++i) {
    for (Eigen::Index j = 0; j < joints; ++j) text += fmt::format("{:.12f},", s.q(i, j));
    for (Eigen::Index k = 0; k < axes; ++k) text += fmt::format("{:.7f},", points_mm(i, k));
    text += fmt::format("{:g},{:.4f},{:.3f},{:.6g}", s.payload(i), s.temperature(i), s.time(i), s.order(i));
    for (Eigen::Index j = 0; j < joints; ++j) text += fmt::format(",{:g}", s.approach(i, j));
    for (Eigen::Index j = 0; j < joints; ++j) text += fmt::format(",{:.9f}", s.read_back(i, j));
    const std::size_t row = i;
    text += repeats ? fmt::format(",{},{}\n", s.pose[row], s.returned[row] ? 1 : 0) : "\n";
  }
  return text;
}

void write(const Case& c, const std::string& folder) {
  const std::filesystem::path root(folder);
  const std::filesystem::path data = root / c.order.name(), hidden = root / "truth";
  std::filesystem::create_directories(data);
  std::filesystem::create_directories(hidden);
  const bool planar = c.arm.planar, repeats = c.options.repeats;
  save(data / "robot.yaml", to_yaml(c.described, c.elastic_joints, c.elastic_values));
  save(data / "measured.csv", to_csv(c.sessions.measured, c.measured_mm, planar, repeats));
  save(data / "heldout.csv", to_csv(c.sessions.held_out, c.held_out_mm, planar, repeats));
  save(hidden / (c.order.name() + ".fresh.csv"), to_csv(c.sessions.fresh, c.fresh_mm, planar, repeats));
  save(hidden / (c.order.name() + ".json"), truth(c).dump(1) + "\n");
}

}  // namespace blind
