// llmt fit --lags, llmt simulate and llmt export as a user runs them.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/random.hpp"

namespace {

using program::Folder;
using program::Outcome;

// A stiffening spring that an input drives, a row every 0.05 s.
std::string spring_record(int rows, std::uint64_t seed, bool has_groups = false) {
  llmt::Random random(seed);
  std::string text = has_groups ? "t,run,u,y\n" : "t,u,y\n";
  double u = 0.0;
  double before = 0.0;
  double y1 = 0.0;
  double y2 = 0.0;
  for (int row = 0; row < rows; ++row) {
    if (row % 3 == 0) u = random.uniform(-3.0, 3.0);
    const double y = 1.4 * y1 - 0.64 * y2 + 0.5 * before - 0.02 * y1 * y1 * y1;
    text += fmt::format("{:.3f},{}{},{}\n", 0.05 * row, has_groups ? (row < rows / 2 ? "a," : "b,") : "", u,
                        y + 0.01 * random.normal());
    y2 = y1;
    y1 = y;
    before = u;
  }
  return text;
}

TEST(DynamicProgram, LearnsRunsAndExports) {
  const Folder folder;
  folder.write("d.csv", spring_record(500, 1));
  folder.write("new.csv", spring_record(300, 2));
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --lags y:1-2,u:1 --time t -o m.json --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const nlohmann::json fit = nlohmann::json::parse(fitted.out);
  EXPECT_NEAR(fit["sample_time"], 0.05, 1e-12);
  EXPECT_EQ(fit["inputs"], nlohmann::json({"u"}));
  EXPECT_EQ(fit["lags"], "y:1-2,u:1");
  EXPECT_EQ(fit["stable"], true);
  EXPECT_LT(fit["held_out"]["rmse"][0], 0.02);
  EXPECT_GT(fit["linear"]["rmse"][0], 0.1);

  const Outcome run = folder.run(LLMT_PROGRAM " simulate m.json new.csv --time t --json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json simulated = nlohmann::json::parse(run.out);
  EXPECT_LT(simulated["errors"]["rmse"][0], 0.02);
  EXPECT_GT(simulated["errors"]["fit_per_cent"][0], 98.0);
  ASSERT_EQ(simulated["simulated"]["y"].size(), 300U);

  const Outcome table = folder.run(LLMT_PROGRAM " simulate m.json new.csv");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  EXPECT_EQ(llmt::Csv::parse(table.out, "out").numbers("y_simulated")(299), simulated["simulated"]["y"][299]);
  EXPECT_NE(table.err.find("fit 9"), std::string::npos) << table.err;

  const Outcome exported = folder.run(LLMT_PROGRAM " export --c m.json -o m.c --name spring");
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_NE(exported.out.find("m.json: 1 input, 1 output; written to"), std::string::npos) << exported.out;
  EXPECT_NE(llmt::read_file(folder.file("m.h")).find("int spring_step(struct spring_state *state"), std::string::npos);
}

TEST(DynamicProgram, ARunMayBeginAtRestAndInEachRecord) {
  const Folder folder;
  folder.write("d.csv", spring_record(400, 3, true));
  ASSERT_EQ(folder.run(LLMT_PROGRAM " fit d.csv -t y --lags y:1-2,u:1 --ignore t --groups run -o m.json").exit_code, 0);
  const Outcome run = folder.run(LLMT_PROGRAM " simulate m.json d.csv --groups run --json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(nlohmann::json::parse(run.out)["records"].size(), 2U);
  folder.write("step.csv", "u\n0\n1\n1\n1\n");
  EXPECT_EQ(folder.run(LLMT_PROGRAM " simulate m.json step.csv").exit_code, 1);
  const Outcome step = folder.run(LLMT_PROGRAM " simulate m.json step.csv --initial 0");
  ASSERT_EQ(step.exit_code, 0) << step.err;
  const Eigen::VectorXd y = llmt::Csv::parse(step.out, "out").numbers("y_simulated");
  EXPECT_EQ(y(0), 0.0);
  EXPECT_NEAR(y(2), 0.5, 0.05);  // the step is one row old
}

// Nine of ten measured values of a run that was not seen lie in the band; a file of an earlier program has none.
TEST(DynamicProgram, ARunHasABand) {
  const Folder folder;
  folder.write("d.csv", spring_record(500, 5));
  folder.write("new.csv", spring_record(800, 6));
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --lags y:1-2,u:1 --time t -o m.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_NE(fitted.out.find("Band of 90 % about runs of y: +-0.0"), std::string::npos) << fitted.out;
  const Outcome run = folder.run(LLMT_PROGRAM " simulate m.json new.csv --time t --interval 0.9 --json");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json simulated = nlohmann::json::parse(run.out);
  EXPECT_EQ(simulated["interval"], 0.9);
  const llmt::Csv measured = llmt::Csv::parse(llmt::read_file(folder.file("new.csv")), "new.csv");
  const Eigen::VectorXd y = measured.numbers("y");
  int inside = 0;
  for (int row = 2; row < 800; ++row)
    inside += simulated["low"]["y"][row] <= y(row) && y(row) <= simulated["high"]["y"][row];
  EXPECT_NEAR(inside / 798.0, 0.9, 0.06);
  EXPECT_NEAR(simulated["inside"][0], inside / 798.0, 1e-12);

  const Outcome table = folder.run(LLMT_PROGRAM " simulate m.json new.csv --interval 0.9");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  const llmt::Csv written = llmt::Csv::parse(table.out, "out");
  EXPECT_EQ(written.columns(), (std::vector<std::string>{"y_simulated", "y_low", "y_high"}));
  EXPECT_EQ(written.numbers("y_low")(799), simulated["low"]["y"][799]);
  EXPECT_EQ(written.numbers("y_high")(799), simulated["high"]["y"][799]);
  EXPECT_NE(table.err.find("% of the measured values lie in the band of 90 %"), std::string::npos) << table.err;
  EXPECT_NE(table.err.find("The held-out runs had at most 123 rows, "), std::string::npos) << table.err;

  EXPECT_NE(folder.run(LLMT_PROGRAM " simulate m.json new.csv --interval 0.9999").err.find("too few"),
            std::string::npos);
  nlohmann::json old = nlohmann::json::parse(llmt::read_file(folder.file("m.json")));
  old.erase("held_out_errors");
  folder.write("old.json", old.dump());
  EXPECT_EQ(folder.run(LLMT_PROGRAM " simulate old.json new.csv").exit_code, 0);
  const Outcome refused = folder.run(LLMT_PROGRAM " simulate old.json new.csv --interval 0.9");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.err.find("no errors of held-out runs"), std::string::npos) << refused.err;
}

TEST(DynamicProgram, SaysWhatTheLocalModelsDoAndWhereTheyRest) {
  const Folder folder;
  folder.write("d.csv", spring_record(500, 7));
  const Outcome fitted = folder.run(LLMT_PROGRAM " fit d.csv -t y --lags y:1-2,u:1 --time t --json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const nlohmann::json fit = nlohmann::json::parse(fitted.out);
  const nlohmann::json& curve = fit["static_curves"][0];
  EXPECT_EQ(curve["input"], "u");
  ASSERT_EQ(curve["points"].size(), 41U);
  for (const nlohmann::json& point : curve["points"]) {
    const double y = point["outputs"][0];
    // 0.24 y + 0.02 y^3 = 0.5 u
    EXPECT_NEAR(0.24 * y + 0.02 * y * y * y, 0.5 * point["input"].get<double>(), 0.06);
    EXPECT_EQ(point["stable"], true);
  }
  const nlohmann::json& local = fit["local_dynamics"][0];
  const nlohmann::json& response = local["step_response"][0][0];
  EXPECT_NEAR(response.back(), local["steady_gain"][0][0], 0.03 * local["steady_gain"][0][0].get<double>());
  EXPECT_GT(local["settling_time"], 0.0);
  EXPECT_EQ(fit["residuals"][0]["frequency"].size(), fit["residuals"][0]["run_spectrum"].size());
  const Outcome text = folder.run(LLMT_PROGRAM " fit d.csv -t y --lags y:1-2,u:1 --time t");
  EXPECT_NE(text.out.find("Static curve"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("settles in s"), std::string::npos) << text.out;
}

// v does nothing: no number of rows is its dead time.
TEST(DynamicProgram, SaysWhichInputHasNoDeadTime) {
  const Folder folder;
  llmt::Random random(31);
  std::string table = "u,v,y\n";
  double before = 0.0;
  double y = 0.0;
  for (int row = 0; row < 300; ++row) {
    const double u = random.normal();
    y = 0.7 * y + 0.5 * before;
    before = u;
    table += fmt::format("{},{},{}\n", u, random.normal(), y + 0.01 * random.normal());
  }
  folder.write("d.csv", table);
  const std::string fit = LLMT_PROGRAM " fit d.csv -t y --lags y:1,u:0,v:0 --delay auto";
  const Outcome found = folder.run(fit + " --json");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  EXPECT_EQ(nlohmann::json::parse(found.out)["delays"], nlohmann::json({1, nullptr}));
  EXPECT_NE(folder.run(fit).out.find("If v acts later, give it: --delay v:ROWS"), std::string::npos);
}

// The sample's pipe holds what flows in back for 30 s, three rows.
TEST(DynamicProgram, FindsTheDeadTimeOfThePipe) {
  const Folder folder;
  const std::string fit = std::string(LLMT_PROGRAM " fit ") + LLMT_DOCS +
                          "/samples/tank.csv -t level_m --time t_s --lags level_m:1,inflow_l_s:1 --json";
  const Outcome found = folder.run(fit + " --delay auto -o m.json");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const nlohmann::json summary = nlohmann::json::parse(found.out);
  EXPECT_EQ(summary["delays"], nlohmann::json({3}));
  EXPECT_EQ(summary["lags"], "level_m:1,inflow_l_s:4");
  const Outcome given = folder.run(fit + " --delay inflow_l_s:3");
  EXPECT_EQ(nlohmann::json::parse(given.out)["held_out"], summary["held_out"]);
  // It rests at (inflow / 10)^2.
  for (const nlohmann::json& point : summary["static_curves"][0]["points"]) {
    EXPECT_NEAR(point["outputs"][0], std::pow(point["input"].get<double>() / 10.0, 2), 0.08);
  }
}

struct RefusedCall {
  const char* call;
  int exit_code;
  const char* message;
};

TEST(DynamicProgram, RefusesWithTheName) {
  const Folder folder;
  folder.write("d.csv", spring_record(100, 4));
  folder.write("short.csv", spring_record(10, 4));
  folder.write("header.csv", "t,u,y\n");
  folder.write("gap.csv", "t,u,y\n0,1,1\n1,1,1\n3,1,1\n4,1,1\n5,1,1\n");
  folder.write("flat.csv", [] {
    std::string text = "u,y\n";
    for (int row = 0; row < 60; ++row) text += fmt::format("{},2\n", row % 7);
    return text;
  }());
  folder.write("torn.csv", "run,u,y\na,1,1\nb,1,2\na,1,3\n");
  ASSERT_EQ(folder.run(LLMT_PROGRAM " fit d.csv -t y --lags y:1-2,u:1 --time t -o m.json").exit_code, 0);
  ASSERT_EQ(folder.run(LLMT_PROGRAM " fit d.csv -t y -o tree.json").exit_code, 0);
  const RefusedCall calls[] = {
      {"fit d.csv -t y --lags y:0", 2, "lags of outputs begin at 1"},
      {"fit d.csv -t y --lags z:1", 2, "--lags: \"z:1\": there is no input or output \"z\"; there are y, "},
      {"fit d.csv -t y --lags auto --stream", 2, "--stream is not for systems that move"},
      {"fit d.csv -t y --lags auto --weight u", 2, "--weight is not for systems that move"},
      {"fit d.csv -t y --lags auto --for ever", 2, "--for is \"ever\""},
      {"fit d.csv -t y --time t", 2, "give --lags too"},
      {"fit d.csv -t y --lags auto --time x", 1, "\"x\""},
      {"fit d.csv -t y --lags auto --delay z:1", 2, "--delay: \"z:1\": there is no input \"z\""},
      {"fit d.csv -t y --lags auto --delay much", 2, "--delay: \"much\": auto, or INPUT:ROWS"},
      {"fit d.csv -t y --delay auto", 2, "give --lags too"},
      {"fit d.csv -t y --lags y:1,u:1 --ignore t --delay u:40", 1,
       "lags reach 41 rows back, and in stretches longer than that there are 100 complete rows"},
      {"simulate m.json d.csv --interval 90", 2, "--interval"},
      {"fit gap.csv -t y --lags auto --time t", 1, "the step of time to line 4 is 2"},
      {"fit torn.csv -t y --lags auto --groups run", 1, "torn.csv:4"},
      {"fit header.csv -t y --lags auto", 1, "there is a header and no rows"},
      {"fit short.csv -t y --lags auto", 1, "10 complete rows"},
      {"fit flat.csv -t y --lags auto", 1, "the output \"y\" never changes"},
      {"simulate m.json tree.json", 1, ""},
      {"simulate tree.json d.csv", 1, "llmt fit --lags makes one"},
      {"simulate d.csv m.json", 2, "the model (JSON) comes first"},
      {"simulate m.json d.csv --initial 1,2", 2, "--initial has 2 values"},
      {"simulate m.json gap.csv --time t", 1, "line 4"},
      {"predict m.json d.csv", 1, "llmt simulate runs it"},
  };
  for (const RefusedCall& of : calls) {
    const Outcome refused = folder.run(std::string(LLMT_PROGRAM " ") + of.call);
    EXPECT_EQ(refused.exit_code, of.exit_code) << of.call << ": " << refused.err;
    EXPECT_NE(refused.err.find(of.message), std::string::npos) << of.call << ": " << refused.err;
  }
  const Outcome grid = folder.run(LLMT_PROGRAM " fit d.csv -t y --lags y:1-2,u:1 --time t --grid 0.1 --json");
  EXPECT_EQ(grid.exit_code, 0) << grid.err;
  EXPECT_EQ(nlohmann::json::parse(grid.out)["sample_time"], 0.1);
}

}  // namespace
