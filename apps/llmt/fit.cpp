#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <map>
#include <memory>
#include <string_view>

#include "llmt/commands.hpp"
#include "llmt/fit.hpp"
#include "llmt/learning.hpp"
#include "llmt/stream_command.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {
namespace {

struct FitArguments {
  LearningArguments learning;
  std::string output;
  bool json = false;
  bool no_intervals = false;
  bool stream = false;
};

template <class Enum>
CLI::CheckedTransformer choice_of() {
  std::map<std::string, Enum> values;
  for (const Choice<Enum>& choice : choices<Enum>()) {
    values.emplace(choice.name, choice.value);
  }
  return CLI::CheckedTransformer(values);
}

// "linear|quadratic|auto [linear]", with the default in brackets.
template <class Enum>
std::string choices_text(Enum standard) {
  return fmt::format("{} [{}]", list_names<Enum>("|"), name_of(standard));
}

// "Growth rule: rd (best split by F test), ...".
std::string rules_text() {
  std::string text;
  for (const Choice<GrowthRule>& choice : choices<GrowthRule>()) {
    text += fmt::format("{}{} ({})", text.empty() ? "Growth rule: " : ", ", choice.name, summary_of(choice.value));
  }
  return text;
}

// "blend, sparse, width 2, jumps from 4, ridge 0.001, shrinkage 0.1".
std::string describe(const Candidate& candidate) {
  const char* const sparse = candidate.sparse ? ", sparse" : "";
  if (candidate.validity.kind == ValidityKind::crisp) {
    const std::string name = fmt::format("{}{}", candidate.leaves == 1 ? "least squares" : "crisp", sparse);
    return candidate.shrinkage > 0.0 ? fmt::format("{}, shrinkage {}", name, candidate.shrinkage) : name;
  }
  const std::string_view kind = candidate.validity.kind == ValidityKind::gaussian   ? "Gaussians"
                                : candidate.validity.kind == ValidityKind::logistic ? "gates"
                                                                                    : "blend";
  std::string text = fmt::format("{}{}, width {}", kind, sparse, number(candidate.validity.width, 3));
  text += candidate.jump < no_jump ? fmt::format(", jumps from {}", number(candidate.jump, 3)) : "";
  text += candidate.estimation == Estimation::as_grown ? ", as grown"
          : candidate.estimation == Estimation::local  ? ", local"
                                                       : fmt::format(", ridge {}", candidate.ridge);
  return candidate.shrinkage > 0.0 ? text + fmt::format(", shrinkage {}", candidate.shrinkage) : text;
}

Json candidate_json(const CandidateError& entry) {
  const auto or_null = [](double value) { return std::isnan(value) ? Json(nullptr) : Json(value); };
  return {{"validity", name_of(entry.candidate.validity.kind)},
          {"width", entry.candidate.validity.width},
          {"jump", entry.candidate.jump < no_jump ? Json(entry.candidate.jump) : Json(nullptr)},
          {"estimation", name_of(entry.candidate.estimation)},
          {"ridge", entry.candidate.ridge},
          {"shrinkage", entry.candidate.shrinkage},
          {"sparse", entry.candidate.sparse},
          {"leaves", entry.candidate.leaves},
          {"local_models", entry.candidate.leaves},
          {"cv_rmse", or_null(entry.rmse)},
          {"spread", or_null(entry.spread)}};
}

double least_squares_rmse(const PartitionSummary& partition) {
  return partition.best_of_kind.empty() ? std::nan("") : partition.best_of_kind.front().rmse;
}

Json summary_json(const FitArguments& arguments, const FitResult& result) {
  Json json;
  json["data"] = arguments.learning.data;
  json["rows"] = result.summary.samples;
  json["missing_values"] = result.summary.missing_values;
  json["rule"] = name_of(arguments.learning.options.rule);
  json["min_leaf_samples"] = result.summary.min_leaf_samples;
  json["inputs"] = Json::array();
  for (const InputColumn& input : result.model.inputs()) {
    json["inputs"].push_back(input.name);
  }
  json["local_models"] = result.summary.quadratic ? "quadratic" : "linear";
  json["partitions"] = Json::array();
  for (const PartitionSummary& partition : result.summary.partitions) {
    Json entry;
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      entry["targets"].push_back(result.model.outputs()[partition.outputs[o]].name);
      entry["train_rmse"].push_back(partition.train_rmse(o));
    }
    entry["leaves"] = partition.leaves;
    entry["local_models"] = partition.leaves;  // one each
    entry["grown_leaves"] = partition.grown_leaves;
    entry["coefficients"] = partition.coefficients;
    entry["rank_deficient_leaves"] = partition.rank_deficient_leaves;
    entry["growth_ended_by"] = describe(partition.stop);
    entry["search"] = {{"exact_nodes", partition.search.exact_nodes},
                       {"binned_nodes", partition.search.binned_nodes},
                       {"evaluations", partition.search.evaluations},
                       {"largest_excess", partition.search.largest_excess}};
    entry["cv_folds"] = partition.cv_folds;
    const bool judged = partition.cv_folds > 0;
    entry["chosen"] = candidate_json(partition.chosen);
    entry["compared"] = Json::array();
    for (const CandidateError& other : partition.best_of_kind) {
      entry["compared"].push_back(candidate_json(other));
    }
    entry["cv_rmse"] = judged ? Json(partition.chosen.rmse) : Json(nullptr);
    entry["cv_rmse_least_squares"] = judged ? Json(least_squares_rmse(partition)) : Json(nullptr);
    entry["crisp_cv_rmse_by_leaves"] =
        std::vector<double>(partition.crisp_cv_rmse.begin(), partition.crisp_cv_rmse.end());
    if (!result.summary.other_terms.empty()) {
      entry["other_terms"] = candidate_json(result.summary.other_terms[json["partitions"].size()]);
    }
    json["partitions"].push_back(std::move(entry));
  }
  json["model"] = arguments.output.empty() ? Json(nullptr) : Json(arguments.output);
  return json;
}

// How the held-out rows came to be.
std::string selection_text(const FitArguments& arguments, const PartitionSummary& partition) {
  if (partition.cv_folds == 0) return "no held-out rows: the tree stays as grown";
  if (partition.cv_folds == 1) {
    return fmt::format("chosen on {} rows held out once", partition.held_out_rows);
  }
  return fmt::format("chosen by {}-fold cross-validation{}, the tree grown anew in every fold", partition.cv_folds,
                     arguments.learning.contiguous ? " over contiguous blocks of rows" : "");
}

// What the local models are made of, and what spoke for it; nothing for what was not asked.
std::string local_models_text(const FitArguments& arguments, const FitSummary& summary) {
  const FitOptions& asked = arguments.learning.options;
  std::string text;
  if (asked.terms != LocalTerms::linear) {
    text += fmt::format("Local models are {}", summary.quadratic ? "quadratic" : "linear");
    for (std::size_t p = 0; p < summary.other_terms.size(); ++p) {
      text += fmt::format("{} RMSE held-out {}",
                          p == 0 ? fmt::format("; {} ones:", summary.quadratic ? "linear" : "quadratic") : ",",
                          number(summary.other_terms[p].rmse));
    }
    text += asked.terms == LocalTerms::automatic && summary.other_terms.empty()
                ? ", without a comparison: it needs folds and 1 to 13 numeric regression inputs.\n"
                : ".\n";
  }
  for (const PartitionSummary& partition : summary.partitions) {
    if (partition.chosen.candidate.sparse) {
      text +=
          fmt::format("Sparse local models: {} coefficients in {} leaves.\n", partition.coefficients, partition.leaves);
    }
  }
  return text;
}

// How the splits of the final tree were searched; nothing if there were none to search.
std::string search_text(const SearchSummary& search) {
  if (search.binned_nodes == 0) {
    return search.exact_nodes == 0 || search.evaluations == 0 ? "" : "Splits searched exactly.\n";
  }
  return fmt::format(
      "Splits searched by bins in {} nodes, exactly in {} small ones. {}\n", search.binned_nodes, search.exact_nodes,
      search.largest_excess > 0.0
          ? fmt::format("A better split may exist by at most {} % of a node's residual sum of squares; --search exact "
                        "looks for it.",
                        number(100.0 * search.largest_excess, 2))
          : "There are no better ones.");
}

void print_summary(const FitArguments& arguments, const FitResult& result) {
  std::vector<std::string> inputs;
  std::vector<std::string> constant;
  for (const InputColumn& input : result.model.inputs()) {
    inputs.push_back(input.is_categorical() ? fmt::format("{} ({} categories)", input.name, input.levels.size())
                                            : input.name);
    if (input.low == input.high) {
      constant.push_back(input.name);
    }
  }
  print(fmt::format("{}: {} rows, {} inputs: {}\n", arguments.learning.data, result.summary.samples, inputs.size(),
                    fmt::join(inputs, ", ")));
  if (result.summary.missing_values > 0) {
    print(fmt::format("Missing values in the inputs: {}\n", result.summary.missing_values));
  }
  if (!constant.empty()) {
    print(fmt::format("Constant, so without influence: {}\n", fmt::join(constant, ", ")));
  }
  print(fmt::format("Rule {}, at least {} rows in a leaf; {}\n\n", name_of(arguments.learning.options.rule),
                    result.summary.min_leaf_samples, selection_text(arguments, result.summary.partitions.front())));
  Table table({"target", "model", "leaves", "RMSE held-out", "+-", "RMSE in-sample"});
  for (const PartitionSummary& partition : result.summary.partitions) {
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      const std::string& target = result.model.outputs()[partition.outputs[o]].name;
      table.add({target, describe(partition.chosen.candidate), fmt::format("{}", partition.leaves),
                 number(partition.chosen.rmse), number(partition.chosen.spread, 2), number(partition.train_rmse(o))});
      if (o > 0) continue;
      const Candidate& chosen = partition.chosen.candidate;
      for (const CandidateError& other : partition.best_of_kind) {
        const Candidate& candidate = other.candidate;
        if (candidate.validity.kind != chosen.validity.kind || candidate.validity.width != chosen.validity.width ||
            candidate.jump != chosen.jump || candidate.leaves != chosen.leaves) {
          table.add({"  against", describe(candidate), fmt::format("{}", candidate.leaves), number(other.rmse),
                     number(other.spread, 2), ""});
        }
      }
    }
  }
  print(table.text());
  if (result.summary.partitions.front().outputs.size() > 1) {
    print("Held-out errors of the shared tree are over all targets, each divided by its standard deviation.\n");
  }
  print(local_models_text(arguments, result.summary));
  for (const PartitionSummary& partition : result.summary.partitions) {
    print(search_text(partition.search));
    // M5' drops inputs on its own; its leaves keep nothing of their parent's but what smoothing gives them.
    if (partition.rank_deficient_leaves > 0 && !has_own_models(arguments.learning.options.rule)) {
      print(fmt::format(
          "Leaves whose rows do not determine all slopes (constant or collinear inputs, few rows) and keep their "
          "parent's there: {}.\n",
          partition.rank_deficient_leaves));
    }
  }
  if (!arguments.output.empty()) {
    print(fmt::format("Model written to {}\n", arguments.output));
  }
}

void fit_command(FitArguments arguments) {
  LearningTable table = read_learning_table(arguments.learning);
  Progress progress("growing trees");
  table.options.intervals = !arguments.no_intervals && !arguments.output.empty();
  table.options.progress = [&](Eigen::Index done, Eigen::Index total) { progress.show(done, total); };
  FitResult result = fit(table.inputs.values, table.outputs, table.options);
  progress.clear();
  result.model = result.model.named(table.names, arguments.learning.targets, table.inputs.levels);
  if (!arguments.output.empty()) {
    save(result.model, result.intervals, arguments.output);
  }
  if (arguments.json) {
    print_json(summary_json(arguments, result));
  } else {
    print_summary(arguments, result);
  }
}

}  // namespace

void add_fit(CLI::App& app) {
  CLI::App* command = app.add_subcommand("fit", "Learn a model from a table");
  command->footer("Example: llmt fit concrete.csv --target strength -o concrete.json");
  const auto arguments = std::make_shared<FitArguments>();
  add_learning_options(*command, arguments->learning);
  FitOptions& options = arguments->learning.options;
  ExpertOptions& expert = options.expert;
  command->add_option("--rule", options.rule, rules_text())
      ->transform(choice_of<GrowthRule>())
      ->option_text(choices_text(options.rule));
  command
      ->add_option("--significance", options.significance,
                   "rd, ra: of the F test, over all candidate splits; 1: no test")
      ->check(CLI::NonNegativeNumber)
      ->option_text(fmt::format("FLOAT [{}]", default_text("significance")));
  command
      ->add_option("--min-improvement", expert.min_improvement,
                   "Stop when further splits lower the training sum of squares by less than this fraction each")
      ->capture_default_str();
  command
      ->add_option("--search", expert.search,
                   "Search for splits: exact; by bins, exact in small nodes and where bins may hold a better split; or "
                   "bins for many rows")
      ->transform(choice_of<SplitSearch>())
      ->option_text(choices_text(expert.search));
  command->add_flag("--shared", options.shared_partition, "One tree for all targets instead of one each");
  command
      ->add_option("--local-models", options.terms,
                   "Local models linear, with products and squares of the inputs, or the better of the two")
      ->transform(choice_of<LocalTerms>())
      ->option_text(choices_text(options.terms));
  command
      ->add_option(
          "--sparse", options.sparse,
          "Local models keep only the slopes that forward selection takes: never, always, or where the held-out "
          "error says so")
      ->transform(choice_of<SparseChoice>())
      ->option_text(choices_text(options.sparse));
  command
      ->add_option("--validity", options.validity,
                   "Crisp leaves, blends over the splits, Gaussians, or the best of the first two")
      ->transform(choice_of<ValidityChoice>())
      ->option_text(choices_text(options.validity));
  command->add_option("--estimation", expert.estimation, "Local models as grown, weighted by validity, or all at once")
      ->transform(choice_of<Estimation>())
      ->option_text(choices_text(expert.estimation));
  command
      ->add_option(
          "--width", expert.widths,
          "Widths to choose from: of a transition by the smaller child's extent; k_sigma; of the gates of hilomot")
      ->delimiter(',')
      ->option_text(fmt::format("FLOAT,... [{}]", default_text("widths")));
  command
      ->add_option("--jump", expert.jumps,
                   "Jumps to choose from: where the output jumps by so many standard deviations there is no transition")
      ->delimiter(',')
      ->option_text(fmt::format("FLOAT,... [{}]", default_text("jumps")));
  command->add_option("--ridge", expert.ridges, "Ridges to choose from: hold of the joint estimate at the local one")
      ->delimiter(',')
      ->option_text(fmt::format("FLOAT,... [{}]", default_text("ridges")));
  command
      ->add_option("--shrinkage", expert.shrinkages, "Shrinkages to choose from: towards the parent's model, in rows")
      ->delimiter(',')
      ->option_text(fmt::format("FLOAT,... [{}]", default_text("shrinkages")));
  command->add_option("-o,--output", arguments->output, "Model file to write");
  command->add_flag("--no-intervals", arguments->no_intervals,
                    "Leave the folds' models out of the file; it is smaller and has no prediction intervals");
  command->add_flag("--json", arguments->json, "Print the summary as JSON");
  command->add_flag("--stream", arguments->stream, "Learn row by row in constant memory; DATA - is standard input");
  command->callback([command, arguments] {
    if (arguments->stream) {
      stream_command(*command, {arguments->learning, arguments->output, arguments->json});
      return;
    }
    fit_command(*arguments);
  });
}

}  // namespace llmt::apps
