// Reports: what the documents say, that the page takes them whole, and what a program without the page answers.
#include "report/document/document.hpp"

#include <cmath>
#include <optional>
#include <string>

#include "apps/program.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "report/document/document_text.hpp"
#include "report/document/figures.hpp"
#include "report/document/page.hpp"
#include "report/fit/comparison.hpp"
#include "report/fit/fit_summary.hpp"
#include "report/fit/mean_of_rows.hpp"
#include "report/fit/of_fit.hpp"
#include "report/model/leaves.hpp"
#include "report/model/rule_text.hpp"
#include "shared/plot.hpp"

namespace {

using namespace llmt::report;

constexpr const char* sample_page = "<title>{{title}}</title><script>{{report}}</script>";

Json data_of(const std::string& page) {
  const std::size_t begin = page.find("<script>") + 8;
  return Json::parse(page.substr(begin, page.rfind("</script>") - begin));
}

struct Sample {
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd outputs;
};

// A slope and a jump, with noise.
Sample jumping(Eigen::Index rows) {
  llmt::Random random(7);
  Sample table{Eigen::MatrixXd(rows, 2), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    table.inputs.row(i) << random.uniform(), random.uniform();
    table.outputs(i, 0) = 2.0 * table.inputs(i, 0) + (table.inputs(i, 1) > 0.5 ? 3.0 : 0.0) + 0.1 * random.normal();
  }
  return table;
}

Document report_of(const Sample& table, llmt::FitOptions options = {}) {
  options.intervals = true;
  const llmt::FitResult result = llmt::fit(table.inputs, table.outputs, options);
  const std::optional<llmt::ReadableResult> none;
  const std::vector<Eigen::Index> lines(table.inputs.rows(), 2);
  const llmt::TrainingData data{table.inputs, table.outputs};
  return fit_report({"folder/table.csv", table.inputs, table.outputs, options, result, none},
                    fit_words({"folder/table.csv", options, data, lines, ""}, result));
}

TEST(Report, HostileNamesStayData) {
  const Document document{.title = "</title><script>alert(1)</script>", .answer = "</script><b>\x01 & \"x\""};
  const std::string page = filled_page(sample_page, document, "origin");
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_EQ(page.find("<b>"), std::string::npos);
  EXPECT_EQ(data_of(page)["answer"], document.answer);
  EXPECT_EQ(data_of(page)["origin"], "origin");
}

TEST(Report, NamesThatAreNotUtf8DoNotStopIt) {
  const std::string page = filled_page(sample_page, {.title = "\xff", .answer = "a\xfe"}, "");
  EXPECT_EQ(data_of(page)["answer"], "a\xef\xbf\xbd");
}

TEST(Report, ATerminalShowsTheWordsAndTablesOfADocument) {
  const Grid values{.title = "Values", .caption = "In mm.", .header = {"name", "value"}, .rows = {{"a", "1.5"}}};
  const Json picture = block(Chart{.title = "picture", .x = {}, .y = {}, .layers = {}});
  Document document{.title = "title", .subject = "table.csv: 3 rows", .answer = "Yes.", .notes = {"Note: few rows"}};
  document.main = Chart{.title = "main", .x = {}, .y = {}, .layers = {}};
  document.beside_main = {block(values)};
  document.sections = {{"pictures alone", "not shown", {picture}},
                       {"words", "Shown.", {text_block("", {"One.", "Two."}), text_block("Titled", {"Three."})}},
                       {"a table for a picture", "", {or_table(picture, values)}}};
  EXPECT_EQ(document_text(document),
            "table.csv: 3 rows\nYes.\nNote: few rows\n"
            "\nValues\nname  value\na       1.5\nIn mm.\n"
            "\nShown.\nOne.\nTwo.\n\nTitled\n  Three.\n"
            "\nValues\nname  value\na       1.5\nIn mm.\n");
  EXPECT_EQ(to_json(document)["lead"], "table.csv: 3 rows. Note: few rows.");
}

TEST(Report, NumbersHaveSixDigitsAndNoNumberIsNull) {
  EXPECT_EQ(numbers({1.0 / 3.0, std::nan(""), INFINITY, 1e-9}).dump(), "[0.333333,null,null,1e-09]");
}

TEST(Report, FitShowsEveryRowByAModelThatHadNotSeenIt) {
  const Sample table = jumping(400);
  const Document document = report_of(table);
  ASSERT_TRUE(document.main);
  EXPECT_EQ(document.main->layers.front().x.size(), 400);
  EXPECT_NE(document.answer.find("y is predicted to within"), std::string::npos) << document.answer;
  EXPECT_EQ(document.title, "llmt fit table.csv");
  const Json page = to_json(document);
  int trees = 0;
  int maps = 0;
  for (const Json& section : page["sections"]) {
    for (const Json& each : section["blocks"]) {
      trees += each["kind"] == "tree";
      maps += each["kind"] == "map";
    }
  }
  EXPECT_EQ(trees, 1);
  EXPECT_EQ(maps, 1);  // two inputs: the boxes
  // Below the charts the page says what the terminal says.
  const std::string text = document_text(document);
  EXPECT_NE(text.find("\ntarget     model"), std::string::npos) << text;
  EXPECT_NE(text.find("\nTree grown by RD (the default), at least "), std::string::npos) << text;
  EXPECT_EQ(page.dump().find("folder"), std::string::npos);
}

TEST(Report, FitSaysWhatMattersAndDrawsCurvesOnOneAxis) {
  const Json page = to_json(report_of(jumping(400)));
  const Json& matters = page["sections"][0]["blocks"][1];
  EXPECT_EQ(matters["title"], "What matters");
  EXPECT_EQ(matters["y"]["categories"], Json::array({"x2", "x1"}));  // a jump of 3, a slope of 2
  const Json& bars = matters["layers"][0];
  for (int k = 0; k < 2; ++k) {
    // An exchanged input adds twice the variance of its part to the squared noise.
    const double expected = std::sqrt(0.01 + 2.0 * (k == 0 ? 9.0 / 4.0 : 4.0 / 12.0)) - 0.1;
    EXPECT_NEAR(bars["y"][k].get<double>(), expected, 0.3);
    EXPECT_LT(bars["low"][k], bars["y"][k]);
    EXPECT_GT(bars["high"][k], bars["y"][k]);
  }
  int curves = 0;
  Json range;
  for (const Json& section : page["sections"]) {
    if (section["title"] != "What it says") continue;
    for (const Json& each : section["blocks"]) {
      if (!each.value("title", "").starts_with("Along ")) continue;
      ++curves;
      if (range.is_null()) range = each["y"]["range"];
      EXPECT_EQ(each["y"]["range"], range);
      EXPECT_EQ(each["layers"].size(), 27U);  // 25 rows, their mean, and where rows lie
      EXPECT_EQ(each["layers"].back()["mark"], "points");
      EXPECT_EQ(each["layers"].back()["x"].size(), 200U);
    }
  }
  EXPECT_EQ(curves, 2);
}

TEST(Report, TheMeanOfTheRowsIsThatOfTheOtherFolds) {
  const Eigen::Vector4d y(0.0, 2.0, 4.0, 6.0);
  const ErrorOfMean error = error_of_mean(y, {}, {{0, 1}, {2, 3}});
  // The mean of the others is 5, then 1: errors 5, 3, 3, 5.
  EXPECT_NEAR(error.rmse, std::sqrt(17.0), 1e-12);
  EXPECT_NEAR(error.spread, 0.0, 1e-12);
  EXPECT_NEAR(error.train, std::sqrt(5.0), 1e-12);
  EXPECT_NEAR(error_of_mean(y, Eigen::Vector4d(1.0, 1.0, 0.0, 0.0), {}).train, 1.0, 1e-12);
  EXPECT_TRUE(std::isnan(error_of_mean(y, {}, {}).rmse));
  EXPECT_TRUE(std::isnan(error_of_mean(y, {}, {{0, 1, 2, 3}}).rmse));
}

TEST(Report, RowsThatTheLossLeftOutAreSaid) {
  const Sample table = jumping(400);
  llmt::FitOptions options;
  const llmt::FitResult result = llmt::fit(table.inputs, table.outputs, options);
  const std::optional<llmt::ReadableResult> none;
  const Document document = fit_report({"t.csv", table.inputs, table.outputs, options, result, none, 3}, {});
  EXPECT_NE(document.main->caption.find("3 rows that the Tukey loss left out are not shown."), std::string::npos);
  EXPECT_EQ(document.main->layers.front().name, "rows, without 3 left out");
  EXPECT_NE(document.lead.find("The Tukey loss left out 3 rows more."), std::string::npos) << document.lead;
}

TEST(Report, FitWithoutFoldsSaysThatNothingWasHeldOut) {
  llmt::FitOptions options;
  options.folds.count = 0;
  const Document document = report_of(jumping(200), options);
  EXPECT_NE(document.answer.find("none was held out"), std::string::npos) << document.answer;
}

TEST(Report, ManyRowsAreThinnedAndThePageSaysSo) {
  const Document document = report_of(jumping(5000));
  EXPECT_EQ(document.main->layers.front().x.size(), most_points);
  EXPECT_NE(document.main->caption.find("3000 of 5000 rows are drawn"), std::string::npos) << document.main->caption;
  EXPECT_LT(to_json(document).dump().size(), 600000);
}

TEST(Report, ComparisonMarksWhatIsRecommended) {
  llmt::ComparisonResult result{{{.method = "a", .fold_rmse = Eigen::Vector2d(1.0, 3.0), .cv_rmse = 2.0},
                                 {.method = "b", .fold_rmse = Eigen::Vector2d(1.0, 1.0), .cv_rmse = 1.0}},
                                1,
                                "Take b."};
  const Sample table = jumping(10);
  const llmt::FitOptions options;
  const std::vector<Eigen::Index> lines(10, 2);
  const llmt::TrainingData data{table.inputs, table.outputs};
  const Document document = comparison_report({"t.csv", options, data, lines, ""}, "y", result);
  EXPECT_EQ(document.answer, "Take b.");
  EXPECT_EQ(document.lead, "t.csv: 10 rows, 2 inputs; y, 2 folds, every choice made inside the fold.");
  EXPECT_EQ(document.main->layers.front().roles[1], "model");
}

TEST(FitSummary, ARuleWithoutAnEnumeratorHasItsTitle) {
  const Sample table = jumping(200);
  llmt::FitOptions options;
  options.rule = llmt::parse<llmt::GrowthRule>("toy");
  const llmt::FitResult result = llmt::fit(table.inputs, table.outputs, options);
  const std::vector<Eigen::Index> lines(200, 2);
  const llmt::TrainingData data{table.inputs, table.outputs};
  const FitRun run{"t.csv", options, data, lines, ""};
  EXPECT_NE(document_text(fit_words(run, result)).find("\nTree grown by Toy halves, at least "), std::string::npos);
  EXPECT_EQ(fit_json(run, result)["rule"], "toy");
}

TEST(Plot, NamesCannotGiveOrdersToGnuplot) {
  const Chart chart{
      .title = "it's\n`touch x`\nset output 'y'", .x = {"x"}, .y = {"y"}, .layers = {{.x = {1.0}, .y = {NAN}}}};
  const std::string script = llmt::apps::gnuplot_script(chart, "svg");
  EXPECT_NE(script.find(R"(set title "it\047s\140touch x\140set output \047y\047")"), std::string::npos) << script;
  EXPECT_NE(script.find("\n1 NaN "), std::string::npos) << script;
}

#define TABLE "x,y\n1,2\n2,4.1\n3,6\n4,8.1\n5,10\n6,12.1\n7,14\n8,16.1\n9,18\n10,20.1\n"

TEST(ReportFiles, AnotherKindOfPictureIsWrongUsage) {
  const program::Folder folder;
  folder.write("t.csv", TABLE);
  const program::Outcome outcome = folder.run(LLMT_PROGRAM " fit t.csv -t y --plot p.pdf");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find(".svg or .png"), std::string::npos) << outcome.err;
}

TEST(ReportFiles, WithoutGnuplotThePackageIsNamedBeforeTheWork) {
  const program::Folder folder;
  folder.write("t.csv", TABLE);
  const program::Outcome outcome = folder.run("PATH=/nowhere " LLMT_PROGRAM " fit t.csv -t y --plot p.svg -o m.json");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.err.find("gnuplot-nox"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder.file("m.json")));
}

TEST(ReportFiles, ThePageIsWholeOrTheProgramSaysHowToGetIt) {
  const program::Folder folder;
  folder.write("t.csv", TABLE);
  const program::Outcome outcome = folder.run(LLMT_PROGRAM " fit t.csv -t y --report r.html");
  if (empty_page().empty()) {
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.err.find("cmake/setup report"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder.file("r.html")));
    return;
  }
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string page = llmt::read_file(folder.file("r.html"));
  EXPECT_TRUE(page.starts_with("<!doctype html>"));
  EXPECT_TRUE(page.ends_with("</html>\n"));
  EXPECT_LT(page.size(), 3'000'000);
  for (const char* part : {"llmt fit t.csv", "Permission is hereby granted", "plotly.js", "default-src 'none'"}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  for (const char* mark : {"{{title}}", "{{report}}", "/*style*/", "/*script*/", "<!--licences-->"}) {
    EXPECT_EQ(page.find(mark), std::string::npos) << mark;
  }
}

TEST(Report, ListsOfNamesEnd) {
  std::vector<std::string> names;
  for (int k = 0; k < 20; ++k) names.push_back("x" + std::to_string(k));
  EXPECT_TRUE(first_names(names).ends_with("x18, x19"));
  names.insert(names.end(), 480, "more");
  EXPECT_TRUE(first_names(names).ends_with("x18, x19 and 480 more")) << first_names(names);
}

TEST(Report, OneFoldHasNoSpread) {
  EXPECT_EQ(spread_text(0.0, 1), "-");
  EXPECT_EQ(spread_text(0.0123, 5), "0.012");
}

TEST(Report, CategoriesAreQuotedAndTheShorterListIsNamed) {
  const llmt::InputColumn input{.name = "maker",
                                .low = 0.0,
                                .high = 4.0,
                                .centre = 0.0,
                                .levels = {"Miller, Ltd", "the \"North\"", "c", "d", "e"}};
  EXPECT_EQ(levels_text(input, {0, 1}), "maker not in {c, d, e}");
  EXPECT_EQ(levels_text(input, {2, 3, 4}), "maker in {c, d, e}");
  EXPECT_EQ(levels_text(input, {0}), "maker = \"Miller, Ltd\"");
  EXPECT_EQ(levels_text(input, {}), "maker is no known category");
  EXPECT_EQ(levels_text(input, {0, 1, 2, 4}), "maker not in {d}");
  EXPECT_EQ(levels_text(input, {1, 2, 3, 4}), "maker not in {\"Miller, Ltd\"}");
  EXPECT_EQ(levels_text(input, {0, 1, 2, 3, 4}).substr(0, 10), "maker in {");
}

// Categories stand below the table, in lines: a column of them would push the numbers far to the right.
TEST(Report, LongListsOfCategoriesDoNotWidenTheTable) {
  llmt::TrainingData data;
  llmt::Random random(3);
  data.inputs = Eigen::MatrixXd(400, 2);
  data.outputs = Eigen::MatrixXd(400, 1);
  std::vector<std::string> levels;
  for (int k = 0; k < 40; ++k) levels.push_back("maker number " + std::to_string(k));
  for (Eigen::Index i = 0; i < 400; ++i) {
    data.inputs.row(i) << random.uniform(), static_cast<double>(i % 40);
    data.outputs(i, 0) = data.inputs(i, 0);
  }
  data.categorical_inputs = {1};
  const llmt::Model model = llmt::fit(data, {.max_leaves = 1}).model.named({"a", "maker"}, {"y"}, {{}, levels});
  const std::string text = leaves_text(model, "m.json");
  EXPECT_NE(text.find("\nmaker: 40 categories: maker number 0, maker number 1, "), std::string::npos) << text;
  for (std::size_t begin = 0; begin < text.find("y: 1 leaf"); begin = text.find('\n', begin) + 1) {
    EXPECT_LE(text.find('\n', begin) - begin, 100U) << text;
  }
}

}  // namespace
