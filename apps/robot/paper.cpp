#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "robot/commands.hpp"
#include "robot/of_paper.hpp"
#include "robot/planar_study.hpp"
#include "robot/tx200_study.hpp"
#include "shared/cli.hpp"
#include "shared/options.hpp"
#include "shared/report_files.hpp"

namespace llmt::apps {
namespace {

struct PaperArguments {
  std::string study = "planar";
  int seeds = 50;
  std::uint64_t seed = 1;
  bool json = false;
  ReportFiles reports;
};

std::string leaves_text(const StudyRow& row) {
  return row.leaves.empty() ? "-" : fmt::format("{} + {}", row.leaves[0], row.leaves[1]);
}

std::string millimetres(double value) { return fmt::format("{:.4f}", value); }

// Errors of the arm's models: in mm, and in per cent of the calibrated model's, which is what can be compared.
void print_arm(const PlanarStudy& study) {
  const TotalError calibrated = study.arm[1].error;
  const TotalError paper_calibrated = *study.arm[1].paper;
  Table table(
      {"model", "leaves x + y", "mean", "max", "mean, %", "max, %", "| paper mean", "max", "mean, %", "max, %"});
  for (const StudyRow& row : study.arm) {
    std::vector<std::string> cells = {row.model,
                                      leaves_text(row),
                                      millimetres(row.error.mean),
                                      millimetres(row.error.max),
                                      number(100.0 * row.error.mean / calibrated.mean, 3),
                                      number(100.0 * row.error.max / calibrated.max, 3)};
    if (row.paper) {
      cells.insert(cells.end(), {number(row.paper->mean, 3), number(row.paper->max, 3),
                                 number(100.0 * row.paper->mean / paper_calibrated.mean, 3),
                                 number(100.0 * row.paper->max / paper_calibrated.max, 3)});
    } else {
      cells.insert(cells.end(), {"-", "-", "-", "-"});
    }
    table.add(std::move(cells));
  }
  print(table.text(output_width()));
}

void print_calibration(const discovery::SolverResult& result) {
  print(fmt::format(
      "L2 {:.3f}, L3 {:.3f}, v2 {:.3f}, v3 {:.3f} mm; calibrability number cond2(J'J) {:.2f}, cond2(J) {:.2f}\n",
      result.parameter("joint2.a").value, result.parameter("tool.x").value, -result.parameter("joint2.b").value,
      -result.parameter("tool.y").value, result.calibrability, std::sqrt(result.calibrability)));
  std::string norms;
  for (const double norm : result.residual_norms) {
    norms += fmt::format(" {:.6f}", norm);
  }
  print(fmt::format("norm of the deviations, at the start and after each iteration:{} mm ({})\n", norms,
                    discovery::to_string(result.termination)));
}

void print_planar(const std::vector<PlanarStudy>& studies) {
  print(
      "Benes et al. 2022, MM Science Journal, doi 10.17973/MMSJ.2022_12_2022160: the flexible planar arm of sections 4 "
      "to 9.\n"
      "Training 1536 poses (steps of 0.1 rad), test 5985 (0.05 rad; they hold the training poses). Errors e_t in mm.\n"
      "%: of the calibrated model's error.\n");
  for (const PlanarStudy& study : studies) {
    print(fmt::format("\nLink bending {}\n",
                      study.carry_over ? "with moment and slope carried over to the next link (Euler-Bernoulli in full)"
                                       : "without carry-over (each link's own tip deflection)"));
    print_arm(study);
    print_calibration(study.calibration);
    print(
        fmt::format("learned from residuals with {} mm of noise, x against the noise-free residual, RMSE: crisp {} mm, "
                    "blend {} mm\n",
                    noise_mm, millimetres(study.noisy_crisp), millimetres(study.noisy_blend)));
  }
  print(
      "paper: L2 1000, L3 999.998, v2 0.41, v3 0.36 mm; calibrability number 1.78; converged in the second "
      "iteration\n");

  print("\nBlack box: trees of the position itself (arm with carry-over)\n");
  Table table({"model", "training poses", "leaves x + y", "mean", "max", "| paper mean", "max"});
  for (const StudyRow& row : studies.front().black_box) {
    table.add({row.model, fmt::format("{}", row.training_poses), leaves_text(row), millimetres(row.error.mean),
               millimetres(row.error.max), row.paper ? number(row.paper->mean, 4) : "-",
               row.paper ? number(row.paper->max, 5) : "-"});
  }
  print(table.text(output_width()));
  print(R"(
What may be compared. The paper does not print its bending model; the physics from its data does not
give its 0.643 mm for the rigid arm, and neither variant above was tuned to it. So the three rows of
the arm are compared as ratios to the calibrated model. The black box hardly feels the bending (1 mm
in 2000): compare it in mm. The leaf counts are the paper's; where it stopped at "less than 2 %" of
an unnamed measure, the row "stopped at 2 %" uses ours: the next ten models lower the sum of squares
by less than 2 % each. The paper's figure for the real Staubli TX200 (0.057 -> 0.0126 mm) is
in-sample: 45 poses, judged on the poses that were fitted. `llmt-robot paper --study tx200` shows
what that is worth.
)");
}

Json row_json(const StudyRow& row) {
  Json json = {{"model", row.model},
               {"training_poses", row.training_poses},
               {"leaves", row.leaves},
               {"mean_mm", row.error.mean},
               {"max_mm", row.error.max}};
  json["paper_mean_mm"] = row.paper ? Json(row.paper->mean) : Json(nullptr);
  json["paper_max_mm"] = row.paper ? Json(row.paper->max) : Json(nullptr);
  return json;
}

Json planar_json(const std::vector<PlanarStudy>& studies) {
  Json json = Json::array();
  for (const PlanarStudy& study : studies) {
    Json entry;
    entry["carry_over"] = study.carry_over;
    entry["parameters_mm"] = {{"L2", study.calibration.parameter("joint2.a").value},
                              {"L3", study.calibration.parameter("tool.x").value},
                              {"v2", -study.calibration.parameter("joint2.b").value},
                              {"v3", -study.calibration.parameter("tool.y").value}};
    entry["calibrability_number"] = study.calibration.calibrability;
    entry["deviation_norms_mm"] = study.calibration.residual_norms;
    entry["termination"] = discovery::to_string(study.calibration.termination);
    for (const StudyRow& row : study.arm) {
      entry["arm"].push_back(row_json(row));
    }
    for (const StudyRow& row : study.black_box) {
      entry["black_box"].push_back(row_json(row));
    }
    entry["noise_mm"] = noise_mm;
    entry["noisy_crisp_rmse_mm"] = study.noisy_crisp;
    entry["noisy_blend_rmse_mm"] = study.noisy_blend;
    json.push_back(std::move(entry));
  }
  return json;
}

// Mean and range over the trials of one figure.
struct Spread {
  double mean = 0.0;
  double low = 0.0;
  double high = 0.0;
};

Spread spread(const std::vector<Tx200Trial>& trials, const std::function<double(const Tx200Trial&)>& figure) {
  std::vector<double> values;
  values.reserve(trials.size());
  for (const Tx200Trial& trial : trials) {
    values.push_back(figure(trial));
  }
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  double sum = 0.0;
  for (const double value : values) {
    sum += value;
  }
  return {sum / static_cast<double>(values.size()), *low, *high};
}

struct Figure {
  const char* name;
  const char* key;
  std::function<double(const Tx200Trial&)> value;
};

const std::vector<Figure>& tx200_figures() {
  static const std::vector<Figure> figures = {
      {"geometric, in-sample, mm", "geometric_in_sample_mm", [](const Tx200Trial& t) { return t.geometric_in_sample; }},
      {"corrected, in-sample, mm", "corrected_in_sample_mm", [](const Tx200Trial& t) { return t.corrected_in_sample; }},
      {"ratio in-sample", "ratio_in_sample",
       [](const Tx200Trial& t) { return t.corrected_in_sample / t.geometric_in_sample; }},
      {"geometric, held-out, mm", "geometric_held_out_mm", [](const Tx200Trial& t) { return t.geometric_held_out; }},
      {"corrected, held-out, mm", "corrected_held_out_mm", [](const Tx200Trial& t) { return t.corrected_held_out; }},
      {"ratio held-out", "ratio_held_out",
       [](const Tx200Trial& t) { return t.corrected_held_out / t.geometric_held_out; }}};
  return figures;
}

void tx200(const PaperArguments& arguments) {
  Json json = {{"seeds", arguments.seeds}, {"poses", 45}, {"noise_um", 10}};
  std::vector<Tx200Trial> with_compliance;
  if (!arguments.json) {
    print(
        fmt::format("A TX200-like arm (table 2 read as modified DH, which is inferred; sixth axis and masses ours), 45 "
                    "random poses, 10 um\n"
                    "noise, {} seeds; five linear models of seven coefficients per axis. Held-out: leave one pose out, "
                    "everything fitted\n"
                    "to the other 44. The paper's ratio for the real arm is 0.22, in-sample.\n",
                    arguments.seeds));
  }
  for (const bool compliance : {true, false}) {
    ProgressBar bar(compliance ? "hidden compliance" : "noise alone");
    const std::vector<Tx200Trial> trials =
        tx200_study(compliance, arguments.seed, arguments.seeds, [&](int done) { bar.show(done, arguments.seeds); });
    bar.clear();
    if (compliance) with_compliance = trials;
    Table table(
        {compliance ? "compliance of axes 2, 3 hidden in the data" : "noise alone", "mean", "smallest", "largest"});
    Json entry;
    for (const Figure& figure : tx200_figures()) {
      const Spread s = spread(trials, figure.value);
      table.add({figure.name, number(s.mean, 3), number(s.low, 3), number(s.high, 3)});
      entry[figure.key] = {{"mean", s.mean}, {"min", s.low}, {"max", s.high}};
    }
    json[compliance ? "hidden_compliance" : "noise_alone"] = std::move(entry);
    if (!arguments.json) {
      print("\n" + table.text(output_width()));
    }
  }
  std::string reports;
  if (arguments.reports.wanted()) {
    reports = write_reports(arguments.reports,
                            tx200_report(with_compliance, tx200_run(true, arguments.seed), arguments.seed));
  }
  if (arguments.json) {
    print_json(json);
  } else {
    print(reports);
  }
}

void paper_command(const PaperArguments& arguments) {
  if (arguments.study == "tx200") {
    tx200(arguments);
    return;
  }
  const std::vector<PlanarStudy> studies = {planar_study(true, true, arguments.seed),
                                            planar_study(false, false, arguments.seed)};
  std::string reports;
  if (arguments.reports.wanted()) {
    reports = write_reports(arguments.reports, planar_report(studies, tx200_run(true, arguments.seed)));
  }
  if (arguments.json) {
    print_json(planar_json(studies));
  } else {
    print_planar(studies);
    print(reports);
  }
}

}  // namespace

void add_paper(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "paper",
      "Make the comparison of Benes et al. 2022 anew\n"
      "planar: table 1, the flexible two-link arm. tx200: what five linear models fitted to 45 poses are "
      "worth on poses they have not seen.");
  command->footer("Example: llmt-robot paper --study tx200 --seeds 10");
  const auto arguments = std::make_shared<PaperArguments>();
  command->add_option("--study", arguments->study, "planar or tx200")
      ->check(CLI::IsMember({"planar", "tx200"}))
      ->capture_default_str();
  add_count(*command, "--seeds", arguments->seeds, 1, "tx200: number of simulated data sets")->capture_default_str();
  add_seed(*command, arguments->seed, "planar: of the cross-validation's folds; tx200: the first seed");
  add_report_options(*command, arguments->reports, "the errors of the models");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([arguments] { paper_command(*arguments); });
}

}  // namespace llmt::apps
