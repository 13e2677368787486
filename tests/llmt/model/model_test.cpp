#include "llmt/model.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <filesystem>
#include <functional>
#include <limits>

#include "llmt/files.hpp"
#include "llmt/fit.hpp"
#include "oracles/edited.hpp"
#include "oracles/oracles.hpp"
#include "oracles/thrown.hpp"

namespace {

using oracle::replaced;

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

TEST(Model, TellsHowFarAQueryLiesOutside) {
  Eigen::MatrixXd x(4, 2);
  x << 0.0, 5.0, 1.0, 5.0, 2.0, 5.0, 4.0, 5.0;
  const llmt::Model model = llmt::fit(x, x.col(0)).model;
  Eigen::MatrixXd query(5, 2);
  query << 0.0, 5.0, 4.0, 5.0, 6.0, 5.0, -1.0, 5.0, 1.0, 5.1;
  const std::vector<llmt::Extrapolation> outside = model.extrapolation(query);
  ASSERT_EQ(outside.size(), 5U);
  EXPECT_EQ(outside[0].distance, 0.0);
  EXPECT_EQ(outside[1].distance, 0.0);
  EXPECT_EQ(outside[2].distance, 0.5);
  EXPECT_EQ(outside[3].distance, 0.25);
  EXPECT_EQ(outside[4].distance, std::numeric_limits<double>::infinity());  // that input never varied
}

TEST(Model, LeverageOfALeafIsThatOfItsLeastSquares) {
  const Eigen::MatrixXd x = oracle::uniform(200, 2, 34);
  const llmt::Model model = llmt::fit(x, oracle::curved(x, 0.02),
                                      {.max_leaves = 3, .validity = llmt::ValidityChoice::crisp, .folds = {.count = 0}})
                                .model;
  const Eigen::MatrixXi leaf_of = model.leaf_of(x);
  Eigen::MatrixXd a(200, 3);
  a << Eigen::VectorXd::Ones(200), x;
  const Eigen::MatrixXd query = 2.0 * oracle::uniform(100, 2, 35);
  const std::vector<llmt::Extrapolation> found = model.extrapolation(query);
  const Eigen::MatrixXi leaf_of_query = model.leaf_of(query);
  for (int k = 0; k < model.partitions()[0].num_leaves(); ++k) {
    Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(3, 3);
    for (int i = 0; i < 200; ++i) {
      if (leaf_of(i, 0) == k) {
        gram += a.row(i).transpose() * a.row(i);
      }
    }
    for (int i = 0; i < 100; ++i) {
      if (leaf_of_query(i, 0) == k) {
        const Eigen::Vector3d at(1.0, query(i, 0), query(i, 1));
        const double expected = at.dot(gram.inverse() * at);
        EXPECT_NEAR(found[i].leverage / expected, 1.0, 1e-9);
      }
    }
  }
}

TEST(Model, RejectsQueriesThatDoNotFit) {
  const llmt::Model model = example();
  using oracle::thrown;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(thrown([&] { model.predict(Eigen::MatrixXd::Zero(3, 1)); }),
            "llmt::Model::predict: inputs has 1 columns, the model has 2 inputs");
  EXPECT_EQ(
      thrown([&] { model.predict(Eigen::MatrixXd::Constant(3, 2, infinity)); }),
      "llmt::Model::predict: inputs(0, 0) is inf, it must be finite, or NaN where it is missing (rows and columns "
      "counted from 0)");
  EXPECT_EQ(thrown([&] { model.jacobian(Eigen::Vector3d::Zero()); }),
            "llmt::Model::jacobian: inputs has 3 columns, the model has 2 inputs");
  EXPECT_EQ(thrown([&] { model.jacobian(Eigen::Vector2d(0.0, std::nan(""))); }),
            "llmt::Model::jacobian: point(0, 1) is nan, it must be finite (rows and columns counted from 0)");
  for (const auto& query : {std::function<void()>([&] { model.validities(Eigen::MatrixXd::Zero(3, 2), 2); }),
                            std::function<void()>([&] { model.leaves(2); })}) {
    EXPECT_EQ(thrown(query).find("llmt::Model::leaves: partition is 2, the model has "), 0U);
  }
  EXPECT_EQ(thrown([&] { model.prefix(0); }), "llmt::prefix: max_leaves is 0, it must be at least 1");
  EXPECT_EQ(model.predict(Eigen::MatrixXd(0, 2)).rows(), 0);
}

TEST(Model, LeavesCoverTheSpaceOnce) {
  const llmt::Model model = example();
  const Eigen::MatrixXd query = 3.0 * oracle::uniform(500, 2, 32);
  for (Eigen::Index p = 0; p < 2; ++p) {
    for (Eigen::Index i = 0; i < query.rows(); ++i) {
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
  ASSERT_EQ(model.partitions()[0].validity.kind, llmt::ValidityKind::blend);
  const std::string json = llmt::to_json(model);
  const llmt::Model back = llmt::from_json(json);
  EXPECT_EQ(llmt::to_json(back), json);
  const Eigen::MatrixXd query = 2.0 * oracle::uniform(100, 2, 33);
  EXPECT_EQ(back.predict(query), model.predict(query));
  EXPECT_EQ(back.inputs()[1].name, "load \"kg\"");
}

TEST(ModelFile, SaysWhatItCannotAccept) {
  const std::string json = llmt::to_json(example());
  EXPECT_EQ(error_of(replaced(json, "\"version\": 2", "\"version\": 1")),
            "m.json: version 1 of the model format cannot be read, this program knows versions 2 to 5");
  EXPECT_EQ(error_of(replaced(json, "llmt-model", "other")),
            "m.json: not a model file: \"format\" is not \"llmt-model\"");
  EXPECT_EQ(error_of(replaced(json, "\"low\": ", "\"lo\": ")), "m.json: /inputs/0: member \"low\" is missing");
  EXPECT_EQ(error_of(replaced(json, "\"threshold\": ", "\"threshold\": null, \"x\": ")),
            "m.json: /partitions/0/nodes/0/split/threshold: a number is needed, not null");
  EXPECT_NE(error_of(json.substr(0, json.size() / 2)).find("m.json: not JSON, or cut off: "), std::string::npos);
  EXPECT_NE(
      error_of(replaced(json, "\"left\": 1", "\"left\": 3")).find("the children 3 and 2 are not in order of growth"),
      std::string::npos);
  const std::size_t nodes = json.find("\"nodes\"");
  EXPECT_NE(error_of(json.substr(0, nodes) + replaced(json.substr(nodes), "\"column\": ", "\"column\": 7, \"x\": "))
                .find("split input 7 does not exist"),
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
  const std::string missing = folder + "/missing/m.json";
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::save(example(), missing); }),
            missing + ": cannot be written: No such file or directory");
  EXPECT_EQ(oracle::thrown<std::runtime_error>([&] { llmt::write_file(folder, "a folder is there"); }),
            folder + ": cannot be written: Is a directory");
  EXPECT_EQ(llmt::read_file(path), before);
  llmt::save(llmt::load(path), path);
  EXPECT_EQ(llmt::read_file(path), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);  // no temporary file stays
  std::filesystem::remove_all(folder);
}

TEST(ModelFile, AFullDiskIsReported) {
  if (!std::filesystem::exists("/dev/full")) return;
  try {
    llmt::write_file("/dev/full", "x");
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()), "/dev/full: cannot be written: No space left on device");
  }
}

}  // namespace
