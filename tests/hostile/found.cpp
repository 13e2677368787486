// What `llmt discover --json` found, as files of unknown origin: applied to rows, and written as code.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hostile/lists.hpp"
#include "llmt/random.hpp"

namespace hostile {
namespace {

using FoundJson = nlohmann::ordered_json;

constexpr int changed_found_files = 300;

// A step, a slope and a settling that the simulation lacks.
void write_tables() {
  llmt::Random random(11);
  std::string simulated = "t,a,b,y\n";
  std::string measured = simulated;
  for (int i = 0; i < 200; ++i) {
    const double a = random.uniform(-2.0, 5.0);
    const double b = random.uniform();
    const double y = 3.0 + 2.0 * a - 4.0 * b;
    const double hidden = (a > 3.2 ? 0.6 : 0.0) + 0.4 * a * b + 0.8 * std::exp(-i / 24.0);
    simulated += fmt::format("{},{},{},{}\n", i, a, b, y);
    measured += fmt::format("{},{},{},{}\n", i, a, b, 0.1 + 1.01 * y + hidden + 0.02 * random.normal());
  }
  write("s.csv", simulated);
  write("m.csv", measured);
}

std::vector<FoundJson> strange_values() {
  FoundJson deep = 1;
  for (int level = 0; level < 40; ++level) deep = FoundJson::array({deep});
  std::string brackets;
  for (int k = 0; k < 4000; ++k) brackets += "sin(";
  return {nullptr,
          -1,
          1e308,
          0,
          true,
          "",
          "a = 1",
          "1 / 0",
          "unknown_name",
          brackets,
          deep,
          std::string(20000, '1'),
          FoundJson::array(),
          "a\n",
          "\"; exit(1);",
          FoundJson::object()};
}

// A byte is replaced, or the end is cut off.
std::string changed_found(std::string text, llmt::Random& random) {
  const std::size_t at = random.below(text.size());
  if (random.below(5) == 0) return text.substr(0, at);
  text[at] = static_cast<char>(random.below(256));
  return text;
}

}  // namespace

void ask_found_files(List& list, const std::string& program) {
  write_tables();
  const Outcome search =
      run({program, "discover", "s.csv", "m.csv", "-t", "y", "--order", "t", "--allow", "offset,scale", "--json"},
          {60.0, 0.0});
  list.judge("a search", search, search.exit_code == 0 ? "" : "no search to change: " + search.err);
  if (search.exit_code != 0) return;
  const std::vector<std::vector<std::string>> uses = {
      {program, "discover", "--apply", "evil.json", "s.csv", "m.csv", "-o", "corrected.csv"},
      {program, "discover", "--apply", "evil.json", "--code", "code.c"},
      {program, "discover", "--apply", "evil.json", "--code", "code.py"}};
  int asked = 0;
  const auto ask = [&](const std::string& name, const std::string& text) {
    write("evil.json", text);
    list.ask(name, uses[asked++ % uses.size()], "evil.json");
  };
  for (int k = 0; k < 3; ++k) ask("as it was found", search.out);
  const FoundJson found = FoundJson::parse(search.out);
  const std::vector<FoundJson> strange = strange_values();
  const FoundJson places = found.flatten();
  for (const auto& [pointer, value] : places.items()) {
    for (const std::size_t kind : {asked % strange.size(), (asked + 7) % strange.size()}) {
      FoundJson changed = found;
      changed[FoundJson::json_pointer(pointer)] = strange[kind];
      ask(fmt::format("{} is value {}", pointer, kind), changed.dump());
    }
  }
  for (const auto& [key, value] : found.items()) {
    FoundJson changed = found;
    changed.erase(key);
    ask("without " + key, changed.dump());
  }
  llmt::Random random(58);
  for (int k = 0; k < changed_found_files; ++k) ask(fmt::format("change {}", k), changed_found(search.out, random));
}

}  // namespace hostile
