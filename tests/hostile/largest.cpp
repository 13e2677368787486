// The largest inputs that are permitted, measured for docs/threat-model.md.
#include <fmt/format.h>

#include <cstdint>

#include "hostile/lists.hpp"

namespace hostile {
namespace {

void measure(List& list, const std::string& name, const std::vector<std::string>& command) {
  list.judge(name, run(command, {.seconds = 600.0, .mebibytes = 0.0}), "");
}

std::string padded(std::string text, std::size_t bytes, char with) {
  return text + std::string(bytes - text.size(), with);
}

}  // namespace

void ask_largest(List& list, const std::string& program, const std::string& robot_program) {
  constexpr std::size_t description = 1 << 24;
  // 16 MiB of URDF: 5000 links in a chain, then as many elements as there may be, with an attribute each.
  std::string urdf = "<robot name=\"a\"><link name=\"k0\"/>";
  for (int k = 1; k < 5000; ++k) {
    urdf += fmt::format(
        "<link name=\"k{0}\"/><joint name=\"j{0}\" type=\"{2}\"><parent link=\"k{1}\"/><child link=\"k{0}\"/></joint>",
        k, k - 1, k < 100 ? "continuous" : "fixed");
  }
  for (int k = 0; k < 300000 - 5000 - 3 * 4999 - 1; ++k) urdf += "<a b=\"123456789012345678901234\"/>";
  write("large.urdf", padded(urdf, description - 8, ' ') + "</robot>");
  measure(list, "URDF of 16 MiB, 300 000 elements, 5000 links",
          {robot_program, "simulate", "large.urdf", "--poses", "1"});

  std::string yaml = "name: a\njoints:\n  - {name: j, type: revolute}\ntool: {xyz_mm: [0, 0, 1]}\n";
  yaml = padded(yaml + "# ", description - 1, 'x') + "\n";
  write("large.yaml", yaml);
  measure(list, "description of 16 MiB", {robot_program, "simulate", "large.yaml", "--poses", "1"});

  std::string mechanism = "mechanism: m\nparameters:\n";
  for (int k = 0; k < 1000; ++k) mechanism += fmt::format("  - {{name: r{}, value_mm: 50}}\n", k);
  mechanism += "joints:\n";
  for (int k = 0; k < 100; ++k) mechanism += fmt::format("  - {{name: q{}, start_deg: 60, limits_deg: [0, 170]}}\n", k);
  mechanism += "outputs:\n";
  for (int k = 0; k < 100; ++k) mechanism += fmt::format("  - {{name: x{}, start_mm: 250}}\n", k);
  mechanism += "definitions:\n";
  for (int k = 0; k < 1000; ++k) mechanism += fmt::format("  d{}: r{}*cos(q{})\n", k, k, k % 100);
  mechanism += "equations:\n";
  for (int k = 0; k < 100; ++k) {
    mechanism += fmt::format("  - x{} = ", k);
    for (int j = 0; j < 10; ++j) mechanism += fmt::format("{}d{}", j == 0 ? "" : " + ", k + 100 * j);
    mechanism += "\n";
  }
  write("large_mechanism.yaml", mechanism);
  measure(list, "mechanism of 1000 parameters and 200 coordinates",
          {robot_program, "mechanism", "large_mechanism.yaml", "--simulate", "1", "-o", "large.csv"});

  std::string table = "a,b,kind,y\n";
  for (std::int64_t i = 0; i < 40000; ++i)
    table += fmt::format("{},{},c{},{}\n", (i * 7919) % 40009, (i * 104729) % 39989, i % 10000, i % 97);
  write("large.csv", table);
  measure(list, "table of 40 000 rows, 10 000 categories: fit",
          {program, "fit", "large.csv", "-t", "y", "--cv", "0", "--max-leaves", "20", "-o", "large.json"});
  measure(list, "its model: predict", {program, "predict", "large.json", "large.csv", "-o", "out.csv"});
  // As many bytes as a model may have, in numbers as models have them; and as many values, each an empty text.
  constexpr std::size_t model_bytes = std::size_t{1} << 28;
  constexpr std::size_t model_values = std::size_t{1} << 24;
  const auto list_of = [](const std::string& value, std::size_t count) {
    std::string text = "{\"format\":[";
    for (std::size_t k = 0; k < count; ++k) text += value + ",";
    return text + value + "]}";
  };
  write("large.json", padded(list_of("\n 0.12345678901234567", model_bytes / 22 - 2), model_bytes, ' '));
  measure(list, "JSON of 256 MiB of numbers, no model", {program, "inspect", "large.json"});
  write("large.json", list_of("\"\"", model_values - 3));
  measure(list, "JSON of 16 777 216 empty texts, no model", {program, "inspect", "large.json"});
}

}  // namespace hostile
