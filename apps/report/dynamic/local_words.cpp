#include "report/dynamic/local_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "llmt/run_band.hpp"
#include "report/dynamic/dynamic_words.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

constexpr Eigen::Index shown_inputs = 3;
constexpr Eigen::Index points_of_text = 5;

std::string pole_text(const Pole& pole) {
  if (std::abs(pole.z.imag()) < 1e-12 && pole.z.real() > 0.0) return number(pole.time_constant);
  return fmt::format("{} (damping {})", number(pole.frequency), number(pole.damping, 3));
}

// "0.12, 3.4 (damping 0.2)": time constants of real poles, frequencies of the others, each pair once.
std::string poles_text(const std::vector<Pole>& poles) {
  std::string text;
  for (const Pole& pole : poles) {
    if (pole.z.imag() < 0.0) continue;
    text += (text.empty() ? "" : ", ") + pole_text(pole);
  }
  return text.empty() ? "none" : text;
}

// Each gain of outputs and inputs, with the names where there are several.
std::string gains_text(const DynamicModel& model, const LocalDynamics& local) {
  std::string gains;
  for (Eigen::Index o = 0; o < local.steady_gain.rows(); ++o) {
    for (Eigen::Index i = 0; i < local.steady_gain.cols(); ++i) {
      const double gain = local.steady_gain(o, i);
      const std::string name = local.steady_gain.size() > 1
                                   ? fmt::format("{}/{} ", model.parts().outputs[o].name, model.parts().inputs[i].name)
                                   : "";
      gains += (gains.empty() ? "" : ", ") + name + (std::isfinite(gain) ? number(gain) : "integrates");
    }
  }
  return gains.empty() ? "no input" : gains;
}

std::string at_rest_text(const RestPoint& point, Eigen::Index output) {
  std::string text = number(point.outputs(output));
  if (point.is_at_stop) text += " (stop)";
  if (!point.is_stable) text += " (unstable)";
  if (!point.is_inside) text += " (outside)";
  return text;
}

}  // namespace

bool has_sums(const DynamicModel& model) {
  return std::ranges::any_of(model.parts().lags.adds_up, [](bool each) { return each; });
}

std::string band_text(const DynamicModel& model) {
  const DynamicParts& parts = model.parts();
  std::string text;
  for (std::size_t o = 0; o < parts.band.outputs.size(); ++o) {
    const std::vector<HeldOutErrors>& lists = parts.band.outputs[o];
    const auto output = static_cast<Eigen::Index>(o);
    const auto width = [&](const HeldOutErrors& list) {
      return "+-" + number(half_width(model, output, list.rows, band_level), 3);
    };
    text += fmt::format("Band of 90 % about runs of {}: ", parts.outputs[o].name);
    if (lists.size() == 1) {
      text += width(lists.front());
    } else {
      std::vector<std::size_t> shown = {0};
      if (lists.size() > 2) shown.push_back(lists.size() / 2);
      shown.push_back(lists.size() - 1);
      for (const std::size_t k : shown) {
        const double rows = std::round(lists[k].rows);
        text +=
            fmt::format("{}{} after {:.0f} row{}", k == 0 ? "" : ", ", width(lists[k]), rows, rows == 1.0 ? "" : "s");
      }
      text += adds_up(parts.lags, output) ? ", then in proportion to the time" : " and more";
    }
    text += fmt::format(" (held-out runs of at most {} rows)\n", parts.band.longest);
  }
  return text;
}

Json band_json(const DynamicModel& model) {
  const RunBand& band = model.parts().band;
  Json json = {{"level", band_level}, {"longest_held_out_run", band.longest}, {"outputs", Json::array()}};
  for (std::size_t o = 0; o < band.outputs.size(); ++o) {
    Json rows = Json::array();
    Json widths = Json::array();
    for (const HeldOutErrors& list : band.outputs[o]) {
      rows.push_back(list.rows);
      widths.push_back(half_width(model, static_cast<Eigen::Index>(o), list.rows, band_level));
    }
    json["outputs"].push_back({{"output", model.parts().outputs[o].name}, {"rows", rows}, {"half_width", widths}});
  }
  return json;
}

std::string local_table(const DynamicModel& model, std::size_t width) {
  const std::string unit = model.parts().time_unit;
  Table table({"where", fmt::format("time constants in {0}, or frequencies in 1/{0}", unit), "steady gain",
               fmt::format("settles in {}", unit), "stable"});
  for (const LocalDynamics& local : local_dynamics(model)) {
    const Eigen::Index settled = settled_rows(local);
    table.add({local.where, poles_text(local.poles), gains_text(model, local),
               settled < 0 ? "never" : number(static_cast<double>(settled) * model.parts().sample_time),
               local.is_stable ? "yes" : "no"});
  }
  return table.text(width);
}

Eigen::Index step_rows(const std::vector<LocalDynamics>& all) {
  constexpr Eigen::Index fewest = 20;
  constexpr Eigen::Index most = 500;
  Eigen::Index rows = 0;
  for (const LocalDynamics& local : all) {
    const Eigen::Index settled = settled_rows(local);
    rows = std::max(rows, settled < 0 ? 100 : settled + settled / 4 + 1);
  }
  return std::clamp(rows, fewest, most);
}

Json local_json(const DynamicModel& model) {
  const std::vector<LocalDynamics> all = local_dynamics(model);
  const Eigen::Index rows = step_rows(all);
  Json json = Json::array();
  for (const LocalDynamics& local : all) {
    Json poles = Json::array();
    for (const Pole& pole : local.poles) {
      poles.push_back({{"re", pole.z.real()},
                       {"im", pole.z.imag()},
                       {"frequency", finite_or_null(pole.frequency)},
                       {"damping", finite_or_null(pole.damping)},
                       {"time_constant", finite_or_null(pole.time_constant)}});
    }
    Json steps = Json::array();
    for (Eigen::Index i = 0; i < model.num_inputs(); ++i) {
      steps.push_back(number_rows(step_response(local, i, rows).transpose()));
    }
    const Eigen::Index settled = settled_rows(local);
    const double time = static_cast<double>(settled) * model.parts().sample_time;
    json.push_back({{"where", local.where},
                    {"poles", std::move(poles)},
                    {"steady_gain", number_rows(local.steady_gain)},
                    {"settling_time", settled < 0 ? Json(nullptr) : Json(time)},
                    {"step_response", std::move(steps)},
                    {"stable", local.is_stable}});
  }
  return json;
}

std::string static_text(const DynamicModel& model, std::size_t width) {
  const DynamicParts& parts = model.parts();
  if (model.num_inputs() == 0) return "";
  if (has_sums(model)) {
    return "An output adds up its changes, so it has no steady value for a steady input: no static curve\n\n";
  }
  std::string text;
  Eigen::Index shown = 0;
  for (Eigen::Index i = 0; i < model.num_inputs() && shown < shown_inputs; ++i) {
    if (!(parts.inputs[i].low < parts.inputs[i].high)) continue;
    ++shown;
    const StaticCurve curve = static_curve(model, i, points_of_text);
    std::vector<std::string> header = {parts.inputs[i].name};
    for (const std::string& name : signal_names(parts.outputs)) header.push_back(name + " at rest");
    Table table(header);
    std::size_t none = 0;
    for (const RestPoint& point : curve.points) {
      for (; none < curve.none.size() && curve.none[none] < point.input; ++none) {
        table.add({number(curve.none[none]), "none found"});
      }
      std::vector<std::string> row = {number(point.input)};
      for (Eigen::Index o = 0; o < point.outputs.size(); ++o) row.push_back(at_rest_text(point, o));
      table.add(row);
    }
    for (; none < curve.none.size(); ++none) table.add({number(curve.none[none]), "none found"});
    text += table.text(width);
  }
  if (shown == 0) return "";
  const std::string others = model.num_inputs() > 1 ? ", the other inputs in the middle of their ranges" : "";
  return fmt::format("Static curve: the output that the model comes to rest at{}:\n{}\n", others, text);
}

Json static_json(const DynamicModel& model) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < model.num_inputs(); ++i) {
    if (!(model.parts().inputs[i].low < model.parts().inputs[i].high)) continue;
    const StaticCurve curve = static_curve(model, i);
    Json points = Json::array();
    for (const RestPoint& point : curve.points) {
      points.push_back({{"input", point.input},
                        {"outputs", number_array(point.outputs)},
                        {"stable", point.is_stable},
                        {"inside", point.is_inside},
                        {"at_stop", point.is_at_stop}});
    }
    json.push_back({{"input", model.parts().inputs[i].name},
                    {"others", number_array(curve.others)},
                    {"points", std::move(points)},
                    {"none", curve.none}});
  }
  return json;
}

}  // namespace llmt::report
