// Model files: those of three fits, with one member replaced.
#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "hostile/lists.hpp"
#include "llmt/random.hpp"

namespace hostile {
namespace {

using Json = nlohmann::json;

std::string table() {
  llmt::Random random(1);
  std::string text = "a,b,kind,y\n";
  for (int i = 0; i < 120; ++i) {
    const double a = random.uniform();
    const double b = random.uniform(0.0, 10.0);
    const char* const kinds[] = {"red", "blue", "green"};
    text += fmt::format("{},{},{},{}\n", a, i % 17 == 3 ? "" : fmt::format("{}", b), kinds[i % 3],
                        (a < 0.5 ? 3.0 * a : 5.0 - 2.0 * a) + 0.1 * b + 0.05 * random.normal());
  }
  return text;
}

Json fitted(const std::string& program, const std::string& file, const std::vector<std::string>& options) {
  std::vector<std::string> command = {program, "fit", "table.csv", "-t", "y", "-o", file};
  command.insert(command.end(), options.begin(), options.end());
  const Outcome outcome = run(command, {.seconds = 60.0});
  if (outcome.exit_code != 0) throw std::runtime_error("no base model: " + outcome.err);
  return Json::parse(read(file));
}

Json& tree(Json& model) { return model["partitions"][0]; }
Json& node(Json& model, int k) { return tree(model)["nodes"][k]; }
Json& split(Json& model) { return node(model, 0)["split"]; }

// A chain of that many splits, in order of growth: the left child is split again.
Json chain(Json model, int splits, double half_width) {
  const Json inner = node(model, 0);
  Json leaf = node(model, 1);
  for (Json& each : tree(model)["nodes"]) {
    if (!each.contains("split")) leaf = each;
  }
  const double low = model["inputs"][0]["low"];
  const double high = model["inputs"][0]["high"];
  Json nodes = Json::array();
  for (int k = 0; k < splits; ++k) {
    Json next = inner;
    next["split"]["left"] = 2 * k + 1;
    next["split"]["right"] = 2 * k + 2;
    next["split"]["threshold"] = high - (high - low) * (k + 1) / (splits + 1);
    next["split"]["half_width"] = half_width * (high - low) / (splits + 1);
    nodes.push_back(next);
    if (k > 0) nodes.push_back(leaf);
  }
  nodes.push_back(leaf);
  nodes.push_back(leaf);
  tree(model)["nodes"] = nodes;
  return model;
}

}  // namespace

void ask_models(List& list, const std::string& program) {
  write("table.csv", table());
  const Json crisp = fitted(program, "crisp.json", {"--validity", "crisp", "--no-intervals", "--max-leaves", "8"});
  const Json blend = fitted(program, "blend.json", {"--validity", "blend", "--no-intervals", "--max-leaves", "8"});
  const Json folds = fitted(program, "folds.json", {"--validity", "crisp", "--cv", "3"});
  using Command = std::vector<std::string>;
  const Command predict = {program, "predict", "evil.json", "table.csv"};
  const auto ask_text = [&](const std::string& name, const std::string& text, const Command& command) {
    write("evil.json", text);
    list.ask(name, command, "evil.json");
  };
  const auto ask = [&](const std::string& name, Json model, const std::function<void(Json&)>& edit) {
    edit(model);
    ask_text(name, model.dump(), predict);
  };
  const auto everything = [&](const std::string& name, const Json& model, bool rules) {
    ask_text(name + ": predict", model.dump(), predict);
    ask_text(name + ": inspect", model.dump(), {program, "inspect", "evil.json"});
    if (rules) ask_text(name + ": rules", model.dump(), {program, "inspect", "evil.json", "--rules"});
    ask_text(name + ": explain", model.dump(), {program, "explain", "evil.json", "table.csv"});
    ask_text(name + ": row", model.dump(), {program, "explain", "evil.json", "table.csv", "--row", "3"});
    ask_text(name + ": export", model.dump(), {program, "export", "--c", "evil.json", "-o", "evil.c"});
  };
  everything("a model", crisp, true);
  everything("a crisp chain of 2000", chain(crisp, 2000, 0.0), true);
  everything("a crisp chain of 20000", chain(crisp, 20000, 0.0), true);
  everything("a blended chain of 2000", chain(blend, 2000, 0.4), false);
  const auto number = [&](const char* name, const char* key, const Json& value) {
    ask(fmt::format("{}: {}", name, value.dump().substr(0, 30)), crisp,
        [&](Json& model) { split(model)[key] = value; });
  };
  for (const int column : {99, -1, 1}) number("column", "column", column);
  number("input", "input", "b");
  for (const double side : {5.0, -1.0}) number("missing_left", "missing_left", side);
  for (const int child : {0, 1, 2, 99, -1}) number("left child", "left", child);
  ask("half_width -1", blend, [](Json& model) { split(model)["half_width"] = -1; });
  ask("half_width 1e300", blend, [](Json& model) { split(model)["half_width"] = 1e300; });
  ask("crisp with half_width", blend, [](Json& model) { tree(model)["validity"]["kind"] = "crisp"; });
  ask("threshold beyond doubles", crisp, [](Json& model) { split(model)["threshold"] = "1e999"; });
  for (const double value : {0.0, -1.0, 1e308}) {
    ask(fmt::format("inverse_gram {}", value), crisp, [&](Json& model) {
      for (Json& each : tree(model)["nodes"]) {
        if (each.contains("inverse_gram"))
          each["inverse_gram"] = Json(std::vector<double>(each["inverse_gram"].size(), value));
      }
    });
  }
  ask("rss -1", crisp, [](Json& model) { node(model, 1)["rss"] = {-1}; });
  ask("slope too short", crisp, [](Json& model) { node(model, 1)["slope"] = {{1}}; });
  ask("slope 1e300", crisp,
      [](Json& model) { node(model, 1)["slope"] = {std::vector<double>(model["regressors"].size(), 1e300)}; });
  ask("value 1e308", crisp, [](Json& model) { node(model, 1)["value"] = {1e308}; });
  ask("no nodes", crisp, [](Json& model) { tree(model)["nodes"] = Json::array(); });
  ask("no partition", crisp, [](Json& model) { model["partitions"] = Json::array(); });
  ask("two partitions of one output", crisp, [](Json& model) { model["partitions"].push_back(Json(tree(model))); });
  ask("outputs [0, 0]", crisp, [](Json& model) { tree(model)["outputs"] = {0, 0}; });
  ask("version 99", crisp, [](Json& model) { model["version"] = 99; });
  ask("low above high", crisp, [](Json& model) { model["inputs"][0]["low"] = 1e9; });
  ask("centre 1e12", crisp, [](Json& model) { model["regressors"][0]["centre"] = 1e12; });
  ask("samples 1e18", crisp, [](Json& model) { node(model, 1)["samples"] = 1000000000000000000; });
  ask("two inputs of one name", crisp, [](Json& model) { model["inputs"][1]["name"] = "a"; });
  ask("a million levels", crisp, [](Json& model) {
    Json levels = Json::array();
    for (int k = 0; k < 1000000; ++k) levels.push_back(fmt::format("q{}", k));
    for (Json& input : model["inputs"]) {
      if (input.contains("levels")) input["levels"] = levels;
    }
  });
  ask("a name of 10 MB", crisp, [](Json& model) { model["inputs"][0]["name"] = std::string(10000000, 'q'); });
  ask("a name with orders", crisp, [](Json& model) { model["outputs"][0]["name"] = "y\n\x1b]0;t\x07\"*/"; });
  ask("residuals below 0", folds, [](Json& model) { model["intervals"][0]["residuals"] = {{-5}}; });
  ask("2000 folds", folds,
      [](Json& model) { model["intervals"] = Json(std::vector<Json>(2000, model["intervals"][0])); });
  constexpr int deep = 100000;
  ask_text("100000 brackets", std::string(deep, '[') + std::string(deep, ']'), predict);
  ask_text("100000 brackets in a member", "{\"format\":\"llmt-model\",\"version\":" + std::string(deep, '['), predict);
  ask_text("a duplicate member", crisp.dump().substr(0, crisp.dump().size() - 1) + ",\"partitions\":[]}", predict);
  ask_text("half a file", crisp.dump().substr(0, crisp.dump().size() / 2), predict);
  std::string numbers = "{\"format\":[";
  for (int k = 0; k < 20000000; ++k) numbers += "1,";
  ask_text("more numbers than memory", numbers + "1]}", predict);
}

void ask_names(List& list, const std::string& program) {
  const std::vector<std::string> names = {"]]><script>alert(1)</script>",
                                          "]]>",
                                          "a, \"b\"",
                                          "'",
                                          "''",
                                          "a'",
                                          "'a",
                                          "a''b",
                                          "a'''b",
                                          "'; system(\"touch PWNED1\") #",
                                          "''; system(\"touch PWNED2\") #",
                                          "a''; system(\"touch PWNED3\") #",
                                          "\"; system(\"touch PWNED4\") #",
                                          "`touch PWNED5`",
                                          "'`touch PWNED6`'",
                                          "$(touch PWNED7)",
                                          "x\n system('touch PWNED8')\n",
                                          "x\r\n!touch PWNED9\r\n",
                                          "x\\",
                                          "x\\\n!touch PWNED10",
                                          "@x",
                                          "<script>alert(1)</script>",
                                          "&lt;b&gt;",
                                          "<!--",
                                          "gr\xC3\xB6\xC3\x9F\x65 \xC2\xB0\x43",
                                          "\xE2\x80\xAE"
                                          "abc",
                                          std::string(10000, 'x'),
                                          std::string(5000, '\''),
                                          "{/Symbol a}",
                                          "%s%n%d",
                                          "#",
                                          "EOD",
                                          "*/ int pwned(void){return 1;} /*",
                                          "*/\n#include \"/etc/passwd\"\n/*",
                                          "?"
                                          "?/\n?"
                                          "?'",
                                          "?"
                                          "?)",
                                          "int",
                                          "\\",
                                          "\\\nint pwned2;",
                                          "//",
                                          "/*",
                                          "\"",
                                          "\\\"",
                                          "a\xE2\x80\xA8\x62",
                                          "\x7f",
                                          "\x1b]0;t\x07",
                                          "0",
                                          "-",
                                          "NULL",
                                          "main",
                                          "double",
                                          "inputs",
                                          "a\\u0041",
                                          "\\x41",
                                          "\xF0\x9F\x98\x80",
                                          "1e5"};
  const auto field = [](const std::string& name) {
    std::string text = "\"";
    for (const char c : name) text += c == '"' ? "\"\"" : std::string(1, c);
    return text + "\"";
  };
  llmt::Random random(1);
  for (const std::string& name : names) {
    for (const std::string role : {"input", "target", "level"}) {
      const std::string target = role == "target" ? field(name) : "y";
      std::string text = fmt::format("{},b,{}\n", role == "input" ? field(name) : "a", target);
      for (int i = 0; i < 60; ++i) {
        const double b = random.uniform();
        const std::string a = role != "level" ? fmt::format("{}", random.uniform())
                              : i % 3 == 0    ? field(name)
                              : i % 3 == 1    ? "p"
                                              : "q";
        text += fmt::format("{},{},{}\n", a, b, b + i % 3);
      }
      write("name.csv", text);
      const std::string shown = fmt::format("{} {}", role, name.substr(0, 20));
      std::string printable;
      for (const char c : shown) printable += c < ' ' || c > '~' ? '.' : c;
      const Outcome outcome = run({program, "fit", "name.csv", "--target=" + target, "--cv", "3", "--validity", "crisp",
                                   "-o", "name.json", "--plot", "name.svg"},
                                  {});
      const Outcome source = run({program, "export", "--c", "name.json", "-o", "name.c"}, {});
      const std::string svg = outcome.exit_code == 0 ? read("name.svg") : "";
      const bool ends = svg.find("]]>") != std::string::npos || svg.find("<script") != std::string::npos;
      const Outcome compiled = run({"/usr/bin/gcc", "-std=c99", "-trigraphs", "-pedantic", "-Wall", "-Wextra",
                                    "-Werror", "-c", "name.c", "-o", "name.o"},
                                   {.mebibytes = 0.0});
      // A level that is a number beside words is a mistake in a column of numbers.
      const bool is_number = outcome.err.find("cells of the column are numbers") != std::string::npos;
      if (role == "level" && is_number) {
        list.judge(printable, outcome, "");
        continue;
      }
      list.judge(printable, outcome,
                 outcome.exit_code != 0 || source.exit_code != 0 ? "not taken"
                 : ends                                          ? "the picture is no XML"
                 : compiled.exit_code != 0                       ? "the source does not compile: " + compiled.err
                                                                 : "");
    }
  }
  const bool was_run = run({"/bin/sh", "-c", "! ls PWNED* >/dev/null 2>&1"}, {}).exit_code != 0;
  list.judge("no name was run", run({"/bin/true"}, {}), was_run ? "a command in a name was run" : "");
}

}  // namespace hostile
