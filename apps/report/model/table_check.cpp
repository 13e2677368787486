#include "report/model/table_check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "llmt/names.hpp"
#include "report/document/figures.hpp"
#include "report/model/rule_text.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

std::string percent(double share) { return fmt::format("{:.3g} %", 100.0 * share); }

std::string figure_or_dash(double value, int digits = 4) { return std::isnan(value) ? "-" : number(value, digits); }

std::string chance(double probability) {
  if (std::isnan(probability)) return "-";
  return probability < 0.001 ? "< 0.001" : fmt::format("{:.3f}", probability);
}

std::string rows_text(Eigen::Index rows) { return fmt::format("{} row{}", rows, rows == 1 ? "" : "s"); }

// "RMSE of cop 0.181 on 200 rows; the file promises 0.0905 for rows like these, good up to 0.0996."
std::string target_sentence(const TableCheckFacts& facts, const CheckedTarget& target) {
  std::string text = fmt::format("RMSE of {} {} on {}", target.name, number(target.rmse), rows_text(target.rows));
  if (!std::isnan(target.promised)) {
    text += fmt::format("; the file promises {} for rows like these", number(target.promised));
  }
  if (!std::isnan(target.limit)) {
    text += fmt::format(", good up to {}{}", number(target.limit), facts.has_limits ? ", as stated" : "");
  }
  text += target.probability < facts.level ? ": more than chance explains." : ".";
  if (!std::isnan(target.covered)) {
    text += fmt::format(" {} of the rows lie in their 90 % intervals{}.", percent(target.covered),
                        target.covered_probability < facts.level ? ", fewer than chance explains" : "");
  }
  return text;
}

std::string verdict_sentence(const TableCheckFacts& facts) {
  switch (facts.check.verdict) {
    case CheckVerdict::good:
      return "GOOD.";
    case CheckVerdict::moved_within_limits:
      return "MOVED, WITHIN LIMITS.";
    case CheckVerdict::no_longer_good:
      return "NO LONGER GOOD.";
    case CheckVerdict::not_evaluated:
      return fmt::format("NOT EVALUATED: {}.", facts.check.reason);
  }
  return "";
}

Grid targets_table(const TableCheck& check) {
  Grid grid{.title = "Errors",
            .header = {"target", "rows", "RMSE now", "promised", "good up to", "by chance", "in 90 %", "by chance"},
            .rows = {}};
  for (const CheckedTarget& target : check.targets) {
    grid.rows.push_back({target.name, std::to_string(target.rows), figure_or_dash(target.rmse),
                         figure_or_dash(target.promised), figure_or_dash(target.limit), chance(target.probability),
                         std::isnan(target.covered) ? "-" : percent(target.covered),
                         chance(target.covered_probability)});
  }
  return grid;
}

// The leaf as it is named in a table: its conditions.
std::string leaf_name(const Model& model, std::size_t output, std::size_t leaf) {
  for (std::size_t p = 0; p < model.partitions().size(); ++p) {
    const Partition& partition = model.partitions()[p];
    if (std::ranges::find(partition.outputs, static_cast<int>(output)) == partition.outputs.end()) continue;
    const std::vector<Leaf> leaves = model.leaves(static_cast<Eigen::Index>(p));
    const std::vector<std::string> conditions = conditions_of(model.inputs(), partition, leaves[leaf]);
    return conditions.empty() ? "everywhere" : fmt::format("{}", fmt::join(conditions, ", "));
  }
  return "";
}

Grid leaves_table(const TableCheckFacts& facts) {
  Grid grid{.title = "Leaves that got worse",
            .header = {"leaf", "where", "rows", "RMSE now", "promised", "by chance"},
            .rows = {},
            .words = {0, 1},
            .wide = true};
  for (std::size_t o = 0; o < facts.check.targets.size(); ++o) {
    const CheckedTarget& target = facts.check.targets[o];
    for (const CheckedLeaf& leaf : target.leaves) {
      if (!leaf.is_worse || facts.tree == nullptr) continue;
      const std::string of = facts.check.targets.size() > 1 ? target.name + " " : "";
      grid.rows.push_back({fmt::format("{}{}", of, leaf.leaf + 1), leaf_name(*facts.tree, o, leaf.leaf),
                           std::to_string(leaf.rows), number(leaf.rmse), number(leaf.promised),
                           chance(leaf.probability)});
    }
  }
  return grid;
}

// "12 below, 3 above the range of training; 4 unknown; 2 empty (1 %, in training 0 %)"
std::string cells_text(const CheckedInput& input) {
  std::vector<std::string> parts;
  if (input.below > 0) parts.push_back(fmt::format("{} below the range of training", input.below));
  if (input.above > 0) parts.push_back(fmt::format("{} above the range of training", input.above));
  if (input.unknown > 0) parts.push_back(fmt::format("{} with a category that training had not", input.unknown));
  if (input.missing > 0) {
    parts.push_back(fmt::format("{} missing ({}, in training {})", input.missing, percent(input.missing_share),
                                percent(input.training_missing_share)));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

bool has_something_to_say(const CheckedInput& input) {
  return input.has_moved || input.below > 0 || input.above > 0 || input.unknown > 0;
}

Grid inputs_table(const TableCheck& check) {
  const bool has_moved = std::ranges::any_of(check.inputs, &CheckedInput::has_moved);
  Grid grid{.title = has_moved ? "Inputs that are not as in training (*)" : "Inputs, as in training but for chance",
            .header = {"input", "cells", "mean", "in training", "shift, sd", "by chance"},
            .rows = {},
            .words = {0, 1},
            .wide = true};
  for (const CheckedInput& input : check.inputs) {
    if (!has_something_to_say(input)) continue;
    grid.rows.push_back({input.name + (input.has_moved ? " *" : ""), cells_text(input), figure_or_dash(input.mean),
                         figure_or_dash(input.training_mean), figure_or_dash(input.shift, 2),
                         chance(input.probability)});
  }
  if (has_moved) grid.caption = "*: beyond chance, or unknown to the model.";
  return grid;
}

// 'mode: AUTO in 12 rows (did you mean "auto"?)'
std::vector<std::string> unknown_lines(const TableCheckFacts& facts) {
  constexpr std::size_t most = 10;
  std::vector<std::string> lines;
  for (std::size_t j = 0; j < facts.words.size(); ++j) {
    std::vector<std::pair<std::string, Eigen::Index>> words(facts.words[j].begin(), facts.words[j].end());
    std::ranges::stable_sort(words, std::greater(), &std::pair<std::string, Eigen::Index>::second);
    for (std::size_t k = 0; k < std::min(words.size(), most); ++k) {
      lines.push_back(fmt::format("{}: {} in {}{}", facts.inputs[j].name, words[k].first, rows_text(words[k].second),
                                  did_you_mean(words[k].first, facts.inputs[j].levels)));
    }
    if (words.size() > most) {
      lines.push_back(fmt::format("{}: and {} more", facts.inputs[j].name, words.size() - most));
    }
  }
  return lines;
}

// Errors over the promised ones: of the targets, and of the leaves that were tested.
Chart errors_chart(const TableCheckFacts& facts) {
  constexpr std::size_t most_leaves = 30;
  std::vector<std::string> names;
  Numbers ratios;
  std::vector<std::string> roles;
  for (const CheckedTarget& target : facts.check.targets) {
    if (!(target.promised > 0.0)) continue;
    names.push_back(fmt::format("{}, all rows", target.name));
    ratios.push_back(target.rmse / target.promised);
    roles.emplace_back(target.is_good ? "model" : "bad");
    for (const CheckedLeaf& leaf : target.leaves) {
      if (std::isnan(leaf.probability) || !(leaf.promised > 0.0) || names.size() > most_leaves) continue;
      names.push_back(fmt::format("leaf {} ({})", leaf.leaf + 1, rows_text(leaf.rows)));
      ratios.push_back(leaf.rmse / leaf.promised);
      roles.emplace_back(leaf.is_worse ? "bad" : "muted");
    }
  }
  Chart chart = ranking("Error now over the promised one", "RMSE now / promised", names, ratios, {});
  chart.layers.front().roles = std::move(roles);
  chart.references.push_back({.vertical = true, .value = 1.0, .name = "as promised"});
  chart.caption = "Red: beyond its limit, or of a leaf beyond chance.";
  return chart;
}

Chart inputs_chart(const TableCheck& check) {
  std::vector<std::string> names;
  Numbers shifts;
  std::vector<std::string> roles;
  for (const CheckedInput& input : check.inputs) {
    if (std::isnan(input.shift)) continue;
    names.push_back(input.name);
    shifts.push_back(input.shift);
    roles.emplace_back(input.has_moved ? "bad" : "muted");
  }
  Chart chart = ranking("How far the means of the inputs moved", "standard deviations in training", names, shifts, {});
  chart.layers.front().roles = std::move(roles);
  return chart;
}

std::string rate_sentence(const TableCheckFacts& facts) {
  const TableCheck& check = facts.check;
  std::string text = fmt::format(
      "{} tests; where nothing changed and rows do not hang together, at most {} of such checks find something.",
      check.tests, percent(facts.level));
  if (!check.has_record) {
    text += " The file has no record of its training rows: inputs and leaves are not tested. A new fit writes one.";
  }
  return text;
}

}  // namespace

std::string check_refusal(const TableCheckFacts& facts) {
  for (const CheckedTarget& target : facts.check.targets) {
    if (target.is_good) continue;
    if (target.rmse > target.limit) {
      return fmt::format("{}: the RMSE of {} is {}, more than {}", facts.data, target.name, number(target.rmse),
                         number(target.limit));
    }
    return fmt::format("{}: the 90 % intervals of {} hold {} of the rows", facts.data, target.name,
                       percent(target.covered));
  }
  return "";
}

Document check_document(const TableCheckFacts& facts) {
  const TableCheck& check = facts.check;
  Document document{
      .title = fmt::format("llmt check {}", file_name(facts.model)),
      .subject = fmt::format("{}: {} beside the training rows of {}", facts.data, rows_text(check.rows), facts.model),
      .answer = verdict_sentence(facts)};
  std::vector<std::string> sentences;
  for (const CheckedTarget& target : check.targets) {
    if (check.targets.size() <= 3 && target.rows > 0) sentences.push_back(target_sentence(facts, target));
  }
  const std::size_t outside = check.outside.size();
  sentences.push_back(outside == 0
                          ? "No row lies outside the range of the training rows."
                          : fmt::format("{} ({}) {} outside the range of the training rows.",
                                        rows_text(static_cast<Eigen::Index>(outside)),
                                        percent(static_cast<double>(outside) / static_cast<double>(check.rows)),
                                        outside == 1 ? "lies" : "lie"));
  document.lead = fmt::format("{}", fmt::join(sentences, " "));
  document.main = errors_chart(facts);
  Section section{.title = "What changed", .text = rate_sentence(facts), .blocks = {}};
  if (check.targets.size() > 1) section.blocks.push_back(block(targets_table(check)));
  if (const Grid leaves = leaves_table(facts); !leaves.rows.empty()) section.blocks.push_back(block(leaves));
  if (const Grid inputs = inputs_table(check); !inputs.rows.empty()) section.blocks.push_back(block(inputs));
  if (const std::vector<std::string> lines = unknown_lines(facts); !lines.empty()) {
    section.blocks.push_back(text_block("Categories that training had not", lines));
  }
  if (section.blocks.empty()) section.blocks.push_back(text_block("", {"Nothing changed beyond chance."}));
  document.beside_main.push_back(block(inputs_chart(check)));
  document.sections.push_back(std::move(section));
  return document;
}

Json check_json(const TableCheckFacts& facts) {
  const TableCheck& check = facts.check;
  Json json = {{"model", facts.model},
               {"data", facts.data},
               {"rows", check.rows},
               {"verdict", std::string(to_string(check.verdict))},
               {"reason", check.reason.empty() ? Json(nullptr) : Json(check.reason)},
               {"level", facts.level},
               {"tests", check.tests},
               {"has_record", check.has_record}};
  json["outside"] = Json::array();
  for (const Eigen::Index row : check.outside) json["outside"].push_back(row + 1);
  json["targets"] = Json::array();
  for (std::size_t o = 0; o < check.targets.size(); ++o) {
    const CheckedTarget& target = check.targets[o];
    Json entry = {{"name", target.name},
                  {"rows", target.rows},
                  {"rmse", finite_or_null(target.rmse)},
                  {"promised", finite_or_null(target.promised)},
                  {"probability", finite_or_null(target.probability)},
                  {"limit", finite_or_null(target.limit)},
                  {"covered", finite_or_null(target.covered)},
                  {"covered_probability", finite_or_null(target.covered_probability)},
                  {"worse", target.is_worse},
                  {"good", target.is_good}};
    entry["leaves"] = Json::array();
    for (const CheckedLeaf& leaf : target.leaves) {
      entry["leaves"].push_back({{"leaf", leaf.leaf + 1},
                                 {"where", facts.tree == nullptr ? "" : leaf_name(*facts.tree, o, leaf.leaf)},
                                 {"rows", leaf.rows},
                                 {"rmse", leaf.rmse},
                                 {"promised", leaf.promised},
                                 {"probability", finite_or_null(leaf.probability)},
                                 {"worse", leaf.is_worse}});
    }
    json["targets"].push_back(std::move(entry));
  }
  json["inputs"] = Json::array();
  for (const CheckedInput& input : check.inputs) {
    Json words = Json::object();
    if (input.input < facts.words.size()) words = facts.words[input.input];
    json["inputs"].push_back({{"name", input.name},
                              {"below", input.below},
                              {"above", input.above},
                              {"unknown", input.unknown},
                              {"unknown_words", std::move(words)},
                              {"missing", input.missing},
                              {"mean", finite_or_null(input.mean)},
                              {"training_mean", finite_or_null(input.training_mean)},
                              {"shift", finite_or_null(input.shift)},
                              {"missing_share", input.missing_share},
                              {"training_missing_share", input.training_missing_share},
                              {"probability", finite_or_null(input.probability)},
                              {"moved", input.has_moved}});
  }
  return json;
}

}  // namespace llmt::report
