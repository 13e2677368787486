// Files of sums of trees: made by hand, and those of fits with numbers and brackets replaced.
#include <fmt/format.h>

#include <array>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "hostile/lists.hpp"
#include "llmt/random.hpp"

namespace hostile {
namespace {

using Json = nlohmann::json;

constexpr int mutated_sums = 400;

// Numbers with missing cells and a category; the target has a jump and an interaction.
std::string table_of_sum() {
  llmt::Random random(2);
  std::string text = "a,b,c,kind,y\n";
  for (int i = 0; i < 90; ++i) {
    const double a = random.uniform();
    const double b = random.uniform(0.0, 10.0);
    const double c = random.normal();
    const char* const kinds[] = {"red", "blue", "green"};
    text += fmt::format("{},{},{},{},{}\n", a, i % 13 == 3 ? "" : fmt::format("{}", b), c, kinds[i % 3],
                        (a < 0.4 ? 2.0 : -1.0) + 0.3 * b * c + 0.5 * (i % 3) + 0.05 * random.normal());
  }
  return text;
}

Json fitted_sum(const std::string& program) {
  const Outcome outcome = run({program, "fit", "sums.csv", "-t", "y", "--boost", "-o", "sum.json"}, {.seconds = 60.0});
  if (outcome.exit_code != 0) throw std::runtime_error("no base sum: " + outcome.err);
  return Json::parse(read("sum.json"));
}

struct Chain {
  int splits = 20;
  int inputs = 20;  // taken in turn
  double half_width = 10.0;
  double smallest_share = 0.0;
  bool to_the_left = true;
  bool in_pairs = false;
  int slopes = 0;  // of each leaf, at whose limits they meet
  int trees = 1;
};

Json chain_of(const Chain& chain) {
  Json inputs = Json::array();
  Json features = Json::array();
  for (int j = 0; j < chain.inputs; ++j) {
    inputs.push_back(
        {{"name", fmt::format("i{}", j)}, {"low", 0.0}, {"high", 1.0}, {"centre", 0.5}, {"deviation", 0.3}});
    features.push_back({{"column", j}});
    if (chain.in_pairs) features.back()["plus_column"] = (j + 1) % chain.inputs;
  }
  Json splits = Json::array();
  Json leaves = Json::array();
  for (int k = 0; k <= chain.splits; ++k) {
    const int next = k + 1 < chain.splits ? k + 1 : -1 - chain.splits;
    if (k < chain.splits) {
      splits.push_back({k % chain.inputs, 0.0, chain.half_width, 1, chain.to_the_left ? next : -1 - k,
                        chain.to_the_left ? -1 - k : next});
    }
    Json leaf = {0.001 * (k % 7), -0.001, 0.001};
    for (int j = 0; j < chain.slopes; ++j) {
      leaf.push_back((k + j) % chain.inputs);
      leaf.push_back(j % 2 == 0 ? 1.0 : -0.7);
    }
    leaves.push_back(leaf);
  }
  const Json tree = {{"splits", splits}, {"leaves", leaves}, {"smallest_share", chain.smallest_share}};
  return {{"format", "llmt-boosted-model"},
          {"version", 1},
          {"inputs", inputs},
          {"outputs", {{{"name", "y"}, {"low", 0.0}, {"high", 1.0}}}},
          {"sums",
           {{{"base", 0.5},
             {"rate", 0.1},
             {"features", features},
             {"residuals", std::vector<double>(60, 0.01)},
             {"trees", std::vector<Json>(chain.trees, tree)}}}}};
}

// Rows that lie within all transitions, and differ in every input.
std::string rows_for(const Chain& chain) {
  std::string text;
  for (int j = 0; j < chain.inputs; ++j) text += fmt::format("{}i{}", j == 0 ? "" : ",", j);
  for (int i = 0; i < 12; ++i) {
    text += "\n";
    for (int j = 0; j < chain.inputs; ++j)
      text += fmt::format("{}{}", j == 0 ? "" : ",", 0.4 + 0.02 * ((i * 7 + j * 3) % 11));
  }
  return text + "\n";
}

using Command = std::vector<std::string>;

std::vector<std::pair<std::string, Command>> commands(const std::string& program) {
  return {{"predict", {program, "predict", "evil.json", "rows.csv"}},
          {"interval", {program, "predict", "evil.json", "rows.csv", "--interval", "0.9"}},
          {"explain", {program, "explain", "evil.json", "rows.csv"}},
          {"row", {program, "explain", "evil.json", "rows.csv", "--row", "3"}},
          {"inspect", {program, "inspect", "evil.json"}},
          {"export", {program, "export", "--c", "evil.json", "-o", "evil.c"}}};
}

// One place of the text changed: a number, a bracket or a few bytes.
std::string mutated(std::string text, llmt::Random& random) {
  constexpr std::array<const char*, 14> numbers = {"0",        "-1",         "1e308", "-1e308", "1e-320",
                                                   "99999999", "2147483648", "1e999", "null",   "\"a\"",
                                                   "[]",       "{}",         "true",  "0.5"};
  const auto pick = [&](std::size_t count) { return static_cast<std::size_t>(random.below(count)); };
  const std::size_t kind = pick(8);
  const std::size_t from = pick(text.size());
  if (kind < 5) {
    const std::size_t begin = text.find_first_of("-0123456789", from);
    if (begin == std::string::npos) return text;
    const std::size_t end = text.find_first_not_of("-+.e0123456789", begin);
    return text.replace(begin, end - begin, numbers[pick(numbers.size())]);
  }
  if (kind == 5) return text.erase(from, pick(40));
  if (kind == 6) return text.insert(from, text.substr(pick(text.size()), pick(200)));
  text[from] = "[]{},:\"\\\xff"[pick(9)];
  return text;
}

}  // namespace

void ask_sums(List& list, const std::string& program) {
  const auto ask = [&](const std::string& name, const std::string& model, const std::string& rows) {
    write("evil.json", model);
    write("rows.csv", rows);
    for (const auto& [what, command] : commands(program)) list.ask(name + ": " + what, command, "evil.json");
  };
  const auto ask_chain = [&](const std::string& name, const Chain& chain) {
    ask(name, chain_of(chain).dump(), rows_for(chain));
  };
  for (const bool left : {true, false}) {
    const std::string side = left ? " to the left" : " to the right";
    ask_chain("2000 soft splits" + side, {.splits = 2000, .inputs = 1, .half_width = 60.0, .to_the_left = left});
    ask_chain("2001 soft splits" + side, {.splits = 2001, .inputs = 1, .half_width = 60.0, .to_the_left = left});
    ask_chain("130000 soft splits" + side, {.splits = 130000, .inputs = 1, .to_the_left = left});
    ask_chain("2000 crisp splits" + side, {.splits = 2000, .inputs = 1, .half_width = 0.0, .to_the_left = left});
  }
  for (const int n : {12, 16, 20, 24, 40, 200}) {
    ask_chain(fmt::format("soft splits of {} inputs", n), {.splits = n, .inputs = n});
    ask_chain(fmt::format("the same of {} with the usual share", n),
              {.splits = n, .inputs = n, .smallest_share = 0.08});
    ask_chain(fmt::format("the same of {} with a tiny share", n), {.splits = n, .inputs = n, .smallest_share = 1e-12});
    ask_chain(fmt::format("crisp pairs of {} inputs", n),
              {.splits = n, .inputs = n, .half_width = 0.0, .in_pairs = true});
    ask_chain(fmt::format("soft pairs of {} inputs", n), {.splits = n, .inputs = n, .in_pairs = true});
    ask_chain(fmt::format("leaves of {} inputs at their limits", n), {.splits = n, .inputs = n, .slopes = 12});
    ask_chain(fmt::format("such leaves of pairs of {}", n),
              {.splits = n, .inputs = n, .smallest_share = 0.08, .in_pairs = true, .slopes = 12});
  }
  ask_chain("100 trees of 16 inputs", {.splits = 16, .inputs = 16, .trees = 100});
  write("sums.csv", table_of_sum());
  const Json sum = fitted_sum(program);
  const std::string rows = read("sums.csv");
  const auto edited = [&](const std::string& name, const std::function<void(Json&)>& edit) {
    Json model = sum;
    edit(model);
    ask(name, model.dump(), rows);
  };
  const auto split = [](Json& model) -> Json& { return model["sums"][0]["trees"][0]["splits"][0]; };
  const auto leaf = [](Json& model) -> Json& { return model["sums"][0]["trees"][0]["leaves"][0]; };
  edited("a sum", [](Json&) {});
  for (int part = 0; part < 6; ++part) {
    for (const double value : {-1.0, 1e308, 1e9, 0.5}) {
      edited(fmt::format("part {} of a split {}", part, value), [&](Json& model) { split(model)[part] = value; });
    }
  }
  for (int part = 0; part < 3; ++part) {
    for (const double value : {-1e308, 1e308}) {
      edited(fmt::format("part {} of a leaf {}", part, value), [&](Json& model) { leaf(model)[part] = value; });
    }
  }
  for (const double share : {-0.1, 0.0, 1e-300, 0.5, 0.6}) {
    edited(fmt::format("smallest_share {}", share),
           [&](Json& model) { model["sums"][0]["trees"][0]["smallest_share"] = share; });
  }
  edited("rate 0", [](Json& model) { model["sums"][0]["rate"] = 0; });
  edited("base 1e308", [](Json& model) { model["sums"][0]["base"] = 1e308; });
  edited("deviation 1e-320", [](Json& model) { model["inputs"][0]["deviation"] = 1e-320; });
  edited("no trees", [](Json& model) { model["sums"][0]["trees"] = Json::array(); });
  edited("no features", [](Json& model) { model["sums"][0]["features"] = Json::array(); });
  edited("residuals that fall", [](Json& model) { model["sums"][0]["residuals"] = {2, 1}; });
  edited("10001 levels", [](Json& model) {
    Json levels = Json::array();
    for (int k = 0; k < 10001; ++k) levels.push_back(fmt::format("q{}", k));
    model["inputs"][3]["levels"] = levels;
  });
  llmt::Random random(57);
  const auto all = commands(program);
  const std::string text = sum.dump();
  write("rows.csv", rows);
  for (int k = 0; k < mutated_sums; ++k) {
    write("evil.json", mutated(text, random));
    const auto& [what, command] = all[k % all.size()];
    list.ask(fmt::format("mutated {}: {}", k, what), command, "evil.json");
  }
}

}  // namespace hostile
