// blind_score: how well a tool found what blind_generate hid.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>

#include "blind/score_tables.hpp"

int main(int argc, char** argv) {
  std::string folder, results;
  bool as_json = false, without_gap = false;
  CLI::App app("Scores the answers of a tool that names missing effects");
  app.add_option("cases", folder, "folder that blind_generate wrote")->required();
  app.add_option("results", results, "folder with <case>.json and <case>.yaml of the tool")->required();
  app.add_flag("--json", as_json, "one JSON object instead of tables");
  app.add_flag("--no-gap", without_gap, "do not evaluate the robots (fast)");
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
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "blind_score: {}\n", error.what());
    return 1;
  }
}
