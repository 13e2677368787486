#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/program.hpp"
#include "llmt/csv.hpp"
#include "llmt/model.hpp"
#include "llmt/random.hpp"
#include "llmt/stream.hpp"

namespace {

using nlohmann::json;
using program::Folder;
using program::Outcome;

// `llmt fit --stream` of column y of `data`.
std::string fit_stream(const std::string& data) { return LLMT_PROGRAM " fit " + data + " --stream -t y "; }

// y has a kink in `a`; a row in ten has no `b`.
std::string kinked_with_gaps(int rows, const char* line_end = "\n") {
  llmt::Random random(1);
  std::string text = fmt::format("a,b,y{}", line_end);
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    const double b = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}{}", a, i % 10 == 3 ? "NA" : fmt::format("{}", b),
                        2.0 * std::abs(a) + 0.05 * random.normal(), line_end);
  }
  return text;
}

TEST(StreamProgram, AFileAPipeAndTheLibraryLearnTheSame) {
  const Folder folder;
  const llmt::Csv csv = llmt::Csv::read(folder.write("d.csv", kinked_with_gaps(30000)));  // more than a piece
  folder.write("crlf.csv", kinked_with_gaps(30000, "\r\n"));
  const Outcome file = folder.run(fit_stream("d.csv") + "-o file.json --json");
  ASSERT_EQ(file.exit_code, 0) << file.err;
  EXPECT_EQ(file.err, "");
  ASSERT_EQ(folder.run("cat d.csv | " + fit_stream("-") + "-o dash.json").exit_code, 0);
  ASSERT_EQ(folder.run("cat crlf.csv | " + fit_stream("-") + "-o pipe.json").exit_code, 0);
  const std::string model = llmt::read_file(folder.file("file.json"));
  EXPECT_EQ(llmt::read_file(folder.file("dash.json")), model);
  EXPECT_EQ(llmt::read_file(folder.file("pipe.json")), model);

  llmt::Stream stream(2, 1);
  stream.add(csv.numbers_or_missing(std::vector<std::string>{"a", "b"}), csv.numbers("y"));
  EXPECT_EQ(llmt::to_json(llmt::load(folder.file("file.json"))),
            llmt::to_json(stream.snapshot().named({"a", "b"}, {"y"})));

  const json summary = json::parse(file.out);
  EXPECT_EQ(summary["rows"], 30000);
  EXPECT_EQ(summary["missing_values"], 3000);
  EXPECT_EQ(summary["inputs"], (std::vector<std::string>{"a", "b"}));
  EXPECT_GE(summary["splits"], 1);
  EXPECT_EQ(summary["drifts"], 0);
  EXPECT_EQ(summary["partitions"][0]["prequential_rmse"], stream.prequential_rmse()(0));
  EXPECT_LT(summary["partitions"][0]["recent_rmse"], 0.06);
  EXPECT_EQ(summary["model"], "file.json");
}

TEST(StreamProgram, TheModelPredictsAndIsInspected) {
  const Folder folder;
  folder.write("d.csv", kinked_with_gaps(5000));
  const Outcome fitted = folder.run(fit_stream("d.csv") + "--ignore b -o m.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  EXPECT_NE(fitted.out.find("d.csv: 5000 rows, 1 inputs: a"), std::string::npos) << fitted.out;
  EXPECT_NE(fitted.out.find("RMSE before learning"), std::string::npos);
  const json predicted = json::parse(folder.run(LLMT_PROGRAM " predict m.json d.csv --json").out);
  EXPECT_LT(predicted["targets"][0]["rmse"], 0.06);
  EXPECT_EQ(folder.run(LLMT_PROGRAM " inspect m.json").exit_code, 0);
}

TEST(StreamProgram, RefusesWithFileLineAndColumn) {
  const Folder folder;
  folder.write("m.json", "old");
  const auto refusal = [&](const std::string& text, const std::string& options = "") {
    folder.write("d.csv", text);
    const Outcome outcome = folder.run(fit_stream("d.csv") + "-o m.json " + options);
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  };
  const std::string rows = kinked_with_gaps(20000);
  EXPECT_NE(refusal(rows + "0.1,red,2\n0,0,0\n")
                .find("d.csv:20002: column \"b\": 'red' is not a number (--stream takes no categories"),
            std::string::npos);
  EXPECT_NE(refusal(rows + "0.1,0.2,\n").find("d.csv:20002: column \"y\": the cell is empty"), std::string::npos);
  EXPECT_NE(refusal(rows + "0.1,0.").find("d.csv:20002: the row has 2 fields, the header has 3 (is the file cut off?)"),
            std::string::npos);
  EXPECT_NE(refusal("a,b,z\n1,2,3\n").find("there is no column \"y\""), std::string::npos);
  EXPECT_NE(refusal("a,b,y\n").find("there is a header and no rows"), std::string::npos);
  EXPECT_NE(refusal("").find("the file is empty"), std::string::npos);
  EXPECT_NE(refusal("a,b,y\n1,2,3\n", "--weight w").find("there is no column \"w\""), std::string::npos);
  EXPECT_EQ(llmt::read_file(folder.file("m.json")), "old");
}

TEST(StreamProgram, WrongUsageIsSaid) {
  const Folder folder;
  folder.write("d.csv", kinked_with_gaps(100));
  const auto usage = [&](const std::string& command) {
    const Outcome outcome = folder.run(LLMT_PROGRAM " fit " + command);
    EXPECT_EQ(outcome.exit_code, 2) << command << outcome.err;
    return outcome.err;
  };
  EXPECT_NE(usage("d.csv -t y --stream --cv 3").find("--cv is not for --stream"), std::string::npos);
  EXPECT_NE(usage("d.csv -t y --stream --shared").find("--shared is not for --stream"), std::string::npos);
  EXPECT_NE(usage("d.csv -t y --stream --monotone a").find("--monotone is not for --stream"), std::string::npos);
  EXPECT_NE(usage("d.csv -t y --stream --local-models auto").find("--local-models is not"), std::string::npos);
  EXPECT_NE(usage("d.csv -t y --stream-rule ra").find("--stream-rule was retired in this version"), std::string::npos);
  EXPECT_NE(usage("-t y --stream").find("data is required"), std::string::npos);
}

}  // namespace
