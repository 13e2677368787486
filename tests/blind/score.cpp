// blind_score: how well a tool found what blind_generate hid.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>

#include "blind/score_tables.hpp"

namespace {

// A hidden effect that should be seen and was neither named in its class nor, if there is no name for it, noticed.
// Below a lambda of 40 that is no fault.
bool overlooked(const blind::Judged& c) {
  if (c.hidden.empty() || c.lambda < 40.0) return false;
  const bool has_name = std::ranges::all_of(c.hidden, &blind::Truth::in_catalogue);
  return has_name ? !c.in_class : c.missed;
}

// 0 if the answers are good enough for a build to pass.
int gate(const std::vector<blind::Judged>& all, int without_result, int most_missed) {
  const auto false_alarms = std::ranges::count_if(all, &blind::Judged::false_alarm);
  const auto wrong = std::ranges::count_if(all, &blind::Judged::confidently_wrong);
  const auto missed = std::ranges::count_if(all, overlooked);
  const bool passed = without_result == 0 && !all.empty() && false_alarms == 0 && wrong == 0 && missed <= most_missed;
  fmt::print(stderr, "gate {}: {} false alarms, {} confidently wrong, {} missed with lambda >= 40 (at most {})\n",
             passed ? "passed" : "failed", false_alarms, wrong, missed, most_missed);
  return passed ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  std::string folder, results;
  int most_missed = -1;
  bool as_json = false, without_gap = false;
  CLI::App app("Scores the answers of a tool that names missing effects");
  app.add_option("cases", folder, "folder that blind_generate wrote")->required();
  app.add_option("results", results, "folder with <case>.json and <case>.yaml of the tool")->required();
  app.add_flag("--json", as_json, "one JSON object instead of tables");
  app.add_flag("--no-gap", without_gap, "do not evaluate the robots (fast)");
  app.add_option("--most-missed", most_missed,
                 "fail on false alarms, confidently wrong names, cases without a result and more misses than this");
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<blind::Judged> all;
    int missing = 0;
    for (const std::string& name : blind::cases(folder)) {
      try {
        blind::Judged one = blind::judge(folder, results, name, !without_gap);
        one.answered ? all.push_back(std::move(one)) : void(++missing);
      } catch (const std::exception& error) {
        fmt::print(stderr, "{}: {}\n", name, error.what());
        ++missing;
      }
    }
    nlohmann::ordered_json json = {{"cases", all.size()}, {"without_result", missing}};
    const std::string text = blind::report(all, json);
    if (as_json) {
      json["each"] = nlohmann::ordered_json::array();
      for (const blind::Judged& c : all) {
        json["each"].push_back({{"case", c.name},
                                {"lambda", c.lambda},
                                {"verdict", c.verdict},
                                {"first", c.first_name},
                                {"right", c.right},
                                {"in_class", c.in_class},
                                {"wrong", c.confidently_wrong},
                                {"extra", c.extra},
                                {"class_size", c.class_size},
                                {"place", c.place}});
        if (c.before) json["each"].back()["before"] = *c.before;
        if (c.after) json["each"].back()["after"] = *c.after;
      }
      fmt::print("{}\n", json.dump(1));
    } else {
      fmt::print("{} cases judged, {} without a result\n{}", all.size(), missing, text);
    }
    return most_missed < 0 ? 0 : gate(all, missing, most_missed);
  } catch (const std::exception& error) {
    fmt::print(stderr, "blind_score: {}\n", error.what());
    return 1;
  }
}
