// blind_strangers: writes cases that share no size with the catalogue. See strangers.sh.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "blind/strangers.hpp"

int main(int argc, char** argv) {
  int cases = 200;
  std::uint64_t seed = 1;
  std::string folder, set;
  CLI::App app("Data sets of arms, drives and instruments as data sheets have them, with hidden physical effects");
  app.add_option("--cases", cases, "how many")->check(CLI::Range(1, 100000))->capture_default_str();
  app.add_option("--seed", seed, "of the run")->capture_default_str();
  app.add_option("--set", set, "write only this set, as none, single, several, gross_single");
  app.add_option("-o,--output", folder, "folder of the cases")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    int written = 0;
    for (const blind::StrangerOrder& order : blind::stranger_plan(cases, seed)) {
      if (!set.empty() && order.set != set) continue;
      blind::write(blind::make_stranger(order), folder);
      ++written;
    }
    fmt::print("{} cases in {}\n", written, folder);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "blind_strangers: {}\n", error.what());
    return 1;
  }
}
