#include "blind/score_tables.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace blind {
namespace {

using OrderedJson = nlohmann::ordered_json;

struct Bin {
  const char* name;
  double low, high;
};
constexpr std::array<Bin, 8> bins = {{{"<15", 0, 15},
                                      {"15-40", 15, 40},
                                      {"40-150", 40, 150},
                                      {"150-1000", 150, 1000},
                                      {"1000-1e4", 1000, 1e4},
                                      {">1e4", 1e4, 1e300},
                                      {">=40", 40, 1e300},
                                      {">=150", 150, 1e300}}};

struct Column {
  const char* name;
  bool (*hit)(const Judged&);
};

bool single(const Judged& c) { return c.hidden.size() == 1 && c.hidden[0].in_catalogue; }
bool unknown(const Judged& c) { return c.hidden.size() == 1 && !c.hidden[0].in_catalogue; }
bool pair(const Judged& c) { return c.hidden.size() == 2; }

const std::vector<Column> none_columns = {{"false alarm", [](const Judged& c) { return c.false_alarm; }},
                                          {"names something", [](const Judged& c) { return c.confirmed > 0; }}};
const std::vector<Column> single_columns = {
    {"right", [](const Judged& c) { return c.right; }},
    {"in class", [](const Judged& c) { return c.in_class; }},
    {"confidently wrong", [](const Judged& c) { return c.confidently_wrong; }},
    {"extra name", [](const Judged& c) { return c.extra && c.in_class; }},
    {"missed", [](const Judged& c) { return c.missed; }},
    {"called unknown", [](const Judged& c) { return c.confirmed == 0 && !c.missed; }},
    {"by alias", [](const Judged& c) { return c.by_alias; }}};
const std::vector<Column> unknown_columns = {
    {"flagged, no name", [](const Judged& c) { return c.confirmed == 0 && !c.missed; }},
    {"wrongly confirmed", [](const Judged& c) { return c.confirmed > 0; }},
    {"missed", [](const Judged& c) { return c.missed; }},
    {"missed, rows dropped as outliers", [](const Judged& c) { return c.missed && c.outliers_wrong > 0; }}};
const std::vector<Column> pair_columns = {
    {"both named", [](const Judged& c) { return c.right && !c.extra; }},
    {"both in class", [](const Judged& c) { return c.in_class && !c.extra; }},
    {"confidently wrong", [](const Judged& c) { return c.confidently_wrong; }},
    {"called unknown", [](const Judged& c) { return c.confirmed == 0 && !c.missed; }},
    {"missed", [](const Judged& c) { return c.missed; }}};

class Report {
 public:
  Report(const std::vector<Judged>& all, OrderedJson& json) : all_(all), json_(json) {}

  void heading(const std::string& text) { text_ += "\n" + text + "\n"; }
  void line(const std::string& text) { text_ += "  " + text + "\n"; }
  const std::string& text() const { return text_; }

  // One line a group; every rate with its number and bounds.
  void rates(const std::string& table, const std::string& row, const Group& group, const std::vector<Column>& columns) {
    if (group.empty()) return;
    std::vector<std::string> cells;
    OrderedJson& json = json_["tables"][table][row];
    for (const Column& column : columns) {
      Rate rate;
      for (const Judged* c : group) rate.add(column.hit(*c));
      cells.push_back(fmt::format("{} {}", column.name, rate.text()));
      json[column.name] = rate.json();
    }
    line(fmt::format("{:<22} {}", row, fmt::join(cells, " | ")));
  }

  // Per arm and pooled, by lambda.
  void by_lambda(const std::string& table, bool (*kind)(const Judged&), const std::vector<Column>& columns) {
    heading(table + " by lambda: hits/n % [one-sided 95 % bounds]");
    for (const std::string& arm : arms()) {
      for (const Bin& bin : bins) {
        const Group group = choose(all_, [&](const Judged& c) {
          return kind(c) && c.dirty.empty() && (arm == "all" || c.arm == arm) && c.lambda >= bin.low &&
                 c.lambda < bin.high;
        });
        rates(table, arm + " " + bin.name, group, columns);
      }
    }
  }

  std::vector<std::string> arms() const {
    std::vector<std::string> names;
    for (const char* arm : {"planar", "tx200", "small6"}) {
      if (std::ranges::find(all_, arm, &Judged::arm) != all_.end()) names.emplace_back(arm);
    }
    names.emplace_back("all");
    return names;
  }

  void no_effect();
  void classes();
  void confusion();
  void wrong();
  void gap();
  void coverage();
  void time();

 private:
  const std::vector<Judged>& all_;
  OrderedJson& json_;
  std::string text_;
};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(std::floor(share * (static_cast<double>(values.size()) - 1.0) + 0.5))];
}

void Report::no_effect() {
  heading("no effect");
  for (const std::string& arm : arms()) {
    for (const char* dirt : {"", "outliers", "heavy_tails", "dwelled"}) {
      const Group group = choose(
          all_, [&](const Judged& c) { return c.hidden.empty() && c.dirty == dirt && (arm == "all" || c.arm == arm); });
      rates("no effect", arm + " " + (*dirt == '\0' ? "clean" : dirt), group, none_columns);
    }
    const Group soft = choose(all_, [&](const Judged& c) {
      return c.hidden.empty() && c.elastic_description && c.dirty.empty() && (arm == "all" || c.arm == arm);
    });
    rates("no effect", arm + " clean, soft arm", soft, none_columns);
  }
  Rate found;
  int wrong = 0;
  for (const Judged& c : all_) {
    found.hits += c.outliers_found;
    found.total += c.outliers_true;
    wrong += c.outliers_wrong;
  }
  line(fmt::format("outliers found {}, good rows dropped {}", found.text(), wrong));
}

void Report::classes() {
  heading("class size and place, named singles with lambda >= 150 (aliases not counted)");
  for (const std::string& arm : arms()) {
    const Group group = choose(all_, [&](const Judged& c) {
      return single(c) && c.dirty.empty() && c.lambda >= 150.0 && c.confirmed > 0 && (arm == "all" || c.arm == arm);
    });
    if (group.empty()) continue;
    double mean = 0.0;
    int aliased = 0;
    std::map<std::string, int> places;
    for (const Judged* c : group) {
      mean += c->class_size / static_cast<double>(group.size());
      aliased += std::ranges::any_of(c->named, [](const Named& n) { return n.confirmed && !n.aliases.empty(); });
      if (!c->place.empty()) ++places[c->place];
    }
    line(fmt::format("{:<8} n {} mean class {:.3f}, with an exact alias {}, place {}", arm, group.size(), mean, aliased,
                     places));
    json_["tables"]["class"][arm] = {{"n", group.size()}, {"mean", mean}, {"with_alias", aliased}, {"place", places}};
  }
}

void Report::confusion() {
  for (const std::string& arm : arms()) {
    heading("confusion, " + arm + ", singles and unknown, lambda >= 40 (truth: first confirmed name x cases)");
    std::map<std::string, std::map<std::string, int>> table;
    for (const Judged& c : all_) {
      const bool wanted = c.hidden.size() == 1 && c.dirty.empty() && c.lambda >= 40.0 && (arm == "all" || c.arm == arm);
      if (wanted) ++table[c.hidden[0].kind][c.first_name];
    }
    for (const auto& [truth, names] : table) {
      std::vector<std::string> cells;
      for (const auto& [name, count] : names) cells.push_back(fmt::format("{} x{}", name, count));
      line(fmt::format("{:<26} {}", truth, fmt::join(cells, ", ")));
    }
    json_["confusion"][arm] = table;
  }
}

void Report::wrong() {
  heading("confidently wrong, or a name where there is none to give");
  json_["wrong"] = OrderedJson::array();
  for (const Judged& c : all_) {
    const bool named_unknown = unknown(c) && c.confirmed > 0;
    if (!c.confidently_wrong && !named_unknown && !c.false_alarm) continue;
    std::vector<std::string> names;
    for (const Named& n : c.named) {
      names.push_back(fmt::format("{}@{}{}", n.family, n.location, n.confirmed ? "" : " (not confirmed)"));
    }
    std::string soft;
    if (c.lambda_beyond_first_order >= 15.0) {
      soft =
          fmt::format(" (lambda {:.0f} of the described softness is beyond first order)", c.lambda_beyond_first_order);
    }
    line(fmt::format("{} lambda {:.0f}: {} {}{}", c.name, c.lambda, c.verdict, fmt::join(names, ", "), soft));
    json_["wrong"].push_back({{"case", c.name}, {"lambda", c.lambda}, {"verdict", c.verdict}, {"names", names}});
  }
}

void Report::gap() {
  heading("held-out error without noise, in noise rms (100 fresh poses)");
  const auto add = [&](const std::string& row, const Group& group) {
    std::vector<double> before, after, ratio;
    Rate worse, half;
    for (const Judged* c : group) {
      if (!c->before || !c->after) continue;
      before.push_back(*c->before);
      after.push_back(*c->after);
      ratio.push_back(*c->after / *c->before);
      worse.add(*c->after > 1.01 * *c->before);
      half.add(*c->after <= 0.5);
    }
    if (after.empty()) return;
    line(fmt::format(
        "{:<34} before med {:.3g}, after med {:.3g} p90 {:.3g}, ratio med {:.3g} p90 {:.3g}, worse {}, <= 0.5 {}", row,
        quantile(before, 0.5), quantile(after, 0.5), quantile(after, 0.9), quantile(ratio, 0.5), quantile(ratio, 0.9),
        worse.text(), half.text()));
    json_["tables"]["gap"][row] = {{"before_median", quantile(before, 0.5)}, {"after_median", quantile(after, 0.5)},
                                   {"after_p90", quantile(after, 0.9)},      {"ratio_median", quantile(ratio, 0.5)},
                                   {"ratio_p90", quantile(ratio, 0.9)},      {"worse", worse.json()}};
  };
  for (const std::string& arm : arms()) {
    const auto of = [&](auto wanted) {
      return choose(all_, [&](const Judged& c) { return wanted(c) && (arm == "all" || c.arm == arm); });
    };
    add(arm + " named, right", of([](const Judged& c) { return single(c) && c.confirmed > 0 && c.right; }));
    add(arm + " named, right, lambda >= 150",
        of([](const Judged& c) { return single(c) && c.confirmed > 0 && c.right && c.lambda >= 150.0; }));
    add(arm + " named, not right", of([](const Judged& c) { return single(c) && c.confirmed > 0 && !c.right; }));
    add(arm + " pairs, something named", of([](const Judged& c) { return pair(c) && c.confirmed > 0; }));
    add(arm + " unknown effects", of([](const Judged& c) { return unknown(c); }));
    add(arm + " no effect", of([](const Judged& c) { return c.hidden.empty(); }));
  }
}

void Report::coverage() {
  heading("95 % intervals that hold the true value (named singles and pairs; compliance and bending see wrong masses)");
  std::map<std::string, Rate> rates;
  std::map<std::string, std::vector<double>> errors;
  for (const Judged& c : all_) {
    for (const Coverage& one : c.coverage) {
      rates[one.what].add(one.covered);
      errors[one.what].push_back(std::abs(one.error_in_std_errors));
    }
  }
  for (const auto& [what, rate] : rates) {
    line(fmt::format("{:<34} {}, median |error|/std error {:.2f}", what, rate.text(), quantile(errors[what], 0.5)));
    json_["coverage"][what] = rate.json();
  }
}

void Report::time() {
  std::vector<double> seconds;
  for (const Judged& c : all_) {
    if (c.seconds) seconds.push_back(*c.seconds);
  }
  if (seconds.empty()) return;
  heading(fmt::format("time of the tool: median {:.2f} s, p90 {:.2f} s, max {:.2f} s", quantile(seconds, 0.5),
                      quantile(seconds, 0.9), quantile(seconds, 1.0)));
  json_["seconds"] = {
      {"median", quantile(seconds, 0.5)}, {"p90", quantile(seconds, 0.9)}, {"max", quantile(seconds, 1.0)}};
}

}  // namespace

std::string report(const std::vector<Judged>& all, OrderedJson& json) {
  Report r(all, json);
  r.no_effect();
  r.by_lambda("singles", single, single_columns);
  r.heading("singles by kind, lambda >= 150");
  std::map<std::string, Group> kinds;
  for (const Judged& c : all) {
    if (single(c) && c.dirty.empty() && c.lambda >= 150.0) kinds[c.hidden[0].kind].push_back(&c);
  }
  for (const auto& [kind, group] : kinds) r.rates("kinds", kind, group, single_columns);
  r.classes();
  r.by_lambda("unknown", unknown, unknown_columns);
  r.by_lambda("pairs", pair, pair_columns);
  r.heading("singles with dirty data, lambda >= 150");
  for (const char* dirt : {"outliers", "heavy_tails", "dwelled"}) {
    r.rates("dirty singles", dirt,
            choose(all, [&](const Judged& c) { return single(c) && c.dirty == dirt && c.lambda >= 150.0; }),
            single_columns);
  }
  r.confusion();
  r.wrong();
  r.gap();
  r.coverage();
  r.time();
  return r.text();
}

}  // namespace blind
