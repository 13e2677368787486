// blind_strangers_score: counts per class of what a tool said about the cases of blind_strangers.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>

#include "blind/score_tables.hpp"

namespace {

using blind::Judged;
using Cases = std::vector<Judged>;

constexpr double visible = 150.0;

bool is_named_wrong(const Judged& c) { return c.confirmed > 0 && !c.in_class; }

// No cause of an instrument has this effect's name; names of an instrument's causes are right all the same.
bool is_flagged(const Judged& c) {
  const bool named = std::ranges::any_of(c.named, [](const blind::Named& n) {
    return n.confirmed && !n.family.starts_with("instrument") && n.family != "drift";
  });
  return !c.missed && !named;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Count {
  int hits = 0, total = 0;
  std::string text() const { return fmt::format("{}/{}", hits, total); }
};

Count count(const Cases& all, const std::function<bool(const Judged&)>& of,
            const std::function<bool(const Judged&)>& hit) {
  Count result;
  for (const Judged& c : all) {
    if (!of(c)) continue;
    ++result.total;
    result.hits += hit(c) ? 1 : 0;
  }
  return result;
}

void print_counts(const Cases& all) {
  const auto is = [](const char* set) { return [set](const Judged& c) { return c.kind == set; }; };
  const auto seen = [](const char* set) {
    return [set](const Judged& c) { return c.kind == set && c.lambda >= visible; };
  };
  const auto line = [&](const char* what, const auto& of, const auto& hit) {
    fmt::print("{:52} {}\n", what, count(all, of, hit).text());
  };
  line("clean: false alarms", is("none"), [](const Judged& c) { return c.false_alarm; });
  line("visible single: in class", seen("single"), [](const Judged& c) { return c.in_class; });
  line("visible single: confidently wrong", seen("single"), is_named_wrong);
  line("visible single: a name too many", seen("single"), [](const Judged& c) { return c.in_class && c.extra; });
  line("visible single: false all-clear", seen("single"), [](const Judged& c) { return c.missed; });
  line("soft backlash: in class", seen("soft_backlash"), [](const Judged& c) { return c.in_class; });
  line("soft backlash: a name too many", seen("soft_backlash"), [](const Judged& c) { return c.in_class && c.extra; });
  line("several: all in class", seen("several"), [](const Judged& c) { return c.in_class; });
  line("several: a name too many", seen("several"), [](const Judged& c) { return c.extra; });
  line("several: false all-clear", seen("several"), [](const Judged& c) { return c.missed; });
  line("unknown: flagged, nothing confirmed", seen("unknown"),
       [](const Judged& c) { return !c.missed && c.confirmed == 0; });
  line("instrument: flagged, or its own name", seen("instrument"), is_flagged);
  line("instrument: false all-clear", seen("instrument"), [](const Judged& c) { return c.missed; });
  line("gross outliers, effect: in class", seen("gross_single"), [](const Judged& c) { return c.in_class; });
  line("gross outliers, effect: false all-clear", seen("gross_single"), [](const Judged& c) { return c.missed; });
  line("gross outliers, effect: confidently wrong", seen("gross_single"), is_named_wrong);
  line("gross outliers, no effect: a confirmed name", is("gross_none"),
       [](const Judged& c) { return c.confirmed > 0; });
  line("gross outliers, no effect: all of them listed", is("gross_none"),
       [](const Judged& c) { return c.outliers_found == c.outliers_true; });
  line(
      "all: 95 % intervals that hold the truth, cases", [](const Judged& c) { return !c.coverage.empty(); },
      [](const Judged& c) { return std::ranges::all_of(c.coverage, &blind::Coverage::covered); });
}

void print_fresh(const Cases& all) {
  fmt::print("\nrms on fresh poses after a right name, from 60 poses on, in noise: median, 90 %\n");
  for (const char* arm : {"scara2", "mini6", "big6", "cobot6", "arm7", ""}) {
    std::vector<double> after;
    for (const Judged& c : all) {
      if (c.after && c.in_class && !c.hidden.empty() && c.poses >= 60 && (c.arm == arm || *arm == 0)) {
        after.push_back(*c.after);
      }
    }
    fmt::print("  {:8} {:3} cases {:8.2f} {:8.2f}\n", *arm ? arm : "all", after.size(), quantile(after, 0.5),
               quantile(after, 0.9));
  }
}

void print_coverage(const Cases& all) {
  std::map<std::string, Count> by_quantity;
  for (const Judged& c : all) {
    for (const blind::Coverage& one : c.coverage) {
      Count& count = by_quantity[one.what];
      ++count.total;
      count.hits += one.covered ? 1 : 0;
    }
  }
  fmt::print("\n95 % intervals that hold the truth\n");
  for (const auto& [what, count] : by_quantity) fmt::print("  {:42} {}\n", what, count.text());
}

bool is_wrong(const Judged& c) {
  if (c.kind == "none") return c.false_alarm;
  if (c.kind == "gross_none") return c.confirmed > 0 || c.outliers_found < c.outliers_true;
  if (c.lambda < visible) return c.extra;
  if (c.kind == "unknown") return c.missed || c.confirmed > 0;
  if (c.kind == "instrument") return !is_flagged(c);
  return !c.in_class || c.extra;
}

void print_faults(const Cases& all) {
  fmt::print("\n");
  for (const Judged& c : all) {
    if (!is_wrong(c)) continue;
    std::string truth, said;
    for (const blind::Truth& t : c.hidden) {
      truth += fmt::format(" {}{}({:.0f})", t.kind, t.locations.empty() ? "" : "@" + t.locations[0], t.lambda);
    }
    for (const blind::Named& n : c.named) {
      said += fmt::format(" {}{}{}{}", n.confirmed ? "" : "?", n.family, n.location.empty() ? "" : "@" + n.location,
                          n.rivals.empty() ? "" : "~" + *n.rivals.begin());
    }
    fmt::print("{}: hidden{} | {}:{} | fresh {:.2f}\n", c.name, truth, c.verdict, said, c.after.value_or(-1.0));
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::string folder, results;
  CLI::App app("Counts per class of what a tool said about the cases of blind_strangers");
  app.add_option("cases", folder, "folder that blind_strangers wrote")->required();
  app.add_option("results", results, "folder with <case>.json and <case>.yaml of the tool")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    Cases all;
    int missing = 0;
    for (const std::string& name : blind::cases(folder)) {
      Judged one = blind::judge(folder, results, name, true);
      one.answered ? all.push_back(std::move(one)) : void(++missing);
    }
    fmt::print("{} cases judged, {} without a result\n\n", all.size(), missing);
    print_counts(all);
    print_fresh(all);
    print_coverage(all);
    print_faults(all);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "blind_strangers_score: {}\n", error.what());
    return 1;
  }
}
