#include "llmt/model.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "llmt/files.hpp"
#include "llmt/fit.hpp"
#include "oracles.hpp"

namespace {

llmt::Model example() {
  const Eigen::MatrixXd x = oracle::uniform(200, 2, 31);
  Eigen::MatrixXd y(200, 2);
  y << oracle::curved(x, 0.02), 1e-7 * x.col(1).cwiseAbs();
  return llmt::fit(x, y).model.named({"angle [deg]", "load \"kg\""}, {"dx", "dy"});
}

std::string error_of(const std::string& json) {
  try {
    llmt::from_json(json, "m.json");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "accepted";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Model, TellsHowFarAQueryLiesOutside) {
  Eigen::MatrixXd x(4, 2);
  x << 0.0, 5.0, 1.0, 5.0, 2.0, 5.0, 4.0, 5.0;
  const llmt::Model model = llmt::fit(x, x.col(0)).model;
  Eigen::MatrixXd query(5, 2);
  query << 0.0, 5.0, 4.0, 5.0, 6.0, 5.0, -1.0, 5.0, 1.0, 5.1;
  const Eigen::VectorXd outside = model.outside(query);
  EXPECT_EQ(outside.head(4), Eigen::Vector4d(0.0, 0.0, 0.5, 0.25));
  EXPECT_EQ(outside(4), std::numeric_limits<double>::infinity());  // that input never varied
}

TEST(Model, RejectsQueriesThatDoNotFit) {
  const llmt::Model model = example();
  EXPECT_THROW(model.predict(Eigen::MatrixXd::Zero(3, 1)), std::invalid_argument);
  EXPECT_THROW(model.predict(Eigen::MatrixXd::Constant(3, 2, std::nan(""))), std::invalid_argument);
  EXPECT_THROW(model.leaves(2), std::invalid_argument);
  EXPECT_THROW(model.prefix(0), std::invalid_argument);
  EXPECT_EQ(model.predict(Eigen::MatrixXd(0, 2)).rows(), 0);
}

TEST(Model, LeavesCoverTheSpaceOnce) {
  const llmt::Model model = example();
  const Eigen::MatrixXd query = 3.0 * oracle::uniform(500, 2, 32);
  for (std::ptrdiff_t p = 0; p < 2; ++p) {
    for (std::ptrdiff_t i = 0; i < query.rows(); ++i) {
      int holding = 0;
      for (const llmt::Leaf& leaf : model.leaves(p)) {
        holding += (query.row(i).transpose().array() > leaf.low.array()).all() &&
                           (query.row(i).transpose().array() <= leaf.high.array()).all()
                       ? 1
                       : 0;
      }
      EXPECT_EQ(holding, 1);
    }
  }
}

TEST(ModelFile, RoundTripIsExact) {
  const llmt::Model model = example();
  const std::string json = llmt::to_json(model);
  const llmt::Model back = llmt::from_json(json);
  EXPECT_EQ(llmt::to_json(back), json);
  const Eigen::MatrixXd query = 2.0 * oracle::uniform(100, 2, 33);
  EXPECT_EQ(back.predict(query), model.predict(query));
  EXPECT_EQ(back.inputs()[1].name, "load \"kg\"");
}

TEST(ModelFile, SaysWhatItCannotAccept) {
  const std::string json = llmt::to_json(example());
  EXPECT_EQ(error_of(replaced(json, "\"version\": 1", "\"version\": 2")),
            "m.json: version 2 of the model format cannot be read, this program knows version 1");
  EXPECT_EQ(error_of(replaced(json, "llmt-model", "other")),
            "m.json: not a model file: \"format\" is not \"llmt-model\"");
  EXPECT_EQ(error_of(replaced(json, "\"low\": ", "\"lo\": ")), "m.json: /inputs/0: member \"low\" is missing");
  EXPECT_EQ(error_of(replaced(json, "\"threshold\": ", "\"threshold\": null, \"x\": ")),
            "m.json: /partitions/0/nodes/0/split/threshold: a number is needed, not null");
  EXPECT_NE(error_of(json.substr(0, json.size() / 2)).find("m.json: not JSON, or cut off: "), std::string::npos);
  EXPECT_NE(
      error_of(replaced(json, "\"left\": 1", "\"left\": 3")).find("the children 3 and 2 are not in order of growth"),
      std::string::npos);
  EXPECT_NE(error_of(replaced(json, "\"column\": ", "\"column\": 7, \"x\": ")).find("split input 7 does not exist"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(json, "\"left\": 1", "\"left\": 4294967297")).find("out of range"), std::string::npos);
  EXPECT_EQ(error_of("[]"), "m.json: not a model file: \"format\" is not \"llmt-model\"");
}

TEST(ModelFile, AFailedWriteLosesNothing) {
  const std::string folder = testing::TempDir() + "/llmt_model_file";
  std::filesystem::create_directories(folder);
  const std::string path = folder + "/m.json";
  llmt::save(example(), path);
  const std::string before = llmt::read_file(path);
  EXPECT_THROW(llmt::save(example(), folder + "/missing/m.json"), std::runtime_error);
  EXPECT_THROW(llmt::write_file(folder, "a folder is there"), std::runtime_error);
  EXPECT_EQ(llmt::read_file(path), before);
  llmt::save(llmt::load(path), path);
  EXPECT_EQ(llmt::read_file(path), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);  // no temporary file stays
  std::filesystem::remove_all(folder);
}

TEST(ModelFile, AFullDiskIsReported) {
  if (!std::filesystem::exists("/dev/full")) {
    return;
  }
  try {
    llmt::write_file("/dev/full", "x");
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()), "/dev/full: cannot be written: No space left on device");
  }
}

}  // namespace
