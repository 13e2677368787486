// blind_generate: writes the cases of a plan.
//
//   blind_generate --plan dev -o cases
//   tests/blind/run.sh build/release/bin/llmt-robot cases results
//   blind_score cases results
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>

#include "blind/plan.hpp"

int main(int argc, char** argv) {
  std::string plan_name = "dev", arm, kind, folder;
  int first = 0, count = -1;
  CLI::App app("Data sets with hidden physical effects, for a tool that names them");
  app.add_option("--plan", plan_name, "dev, frozen (other seeds) or gate (short)")->capture_default_str();
  app.add_option("--arm", arm, "planar, tx200 or small6; all if absent");
  app.add_option("--kind", kind, "this kind alone, as none, none_outliers, pair or drift");
  app.add_option("--first", first, "skip this number of the chosen cases")->capture_default_str();
  app.add_option("--count", count, "write at most this number; -1: all")->capture_default_str();
  app.add_option("-o,--output", folder, "folder of the cases")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<blind::Order> orders;
    for (const std::string name : {"planar", "tx200", "small6"}) {
      if (!arm.empty() && arm != name) continue;
      for (blind::Order& order : blind::plan(plan_name, name)) {
        const std::string full = order.kind + (order.dirty.empty() ? "" : "_" + order.dirty);
        if (kind.empty() || kind == full) orders.push_back(std::move(order));
      }
    }
    if (orders.empty()) throw std::invalid_argument("no case with this arm and kind");
    const auto begin = std::min<std::size_t>(static_cast<std::size_t>(std::max(first, 0)), orders.size());
    const auto end = count < 0 ? orders.size() : std::min(orders.size(), begin + count);
    for (std::size_t i = begin; i < end; ++i) blind::write(blind::make_case(orders[i]), folder);
    fmt::print("{} cases in {}\n", end - begin, folder);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "blind_generate: {}\n", error.what());
    return 1;
  }
}
