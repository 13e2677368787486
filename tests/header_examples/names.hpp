// What the examples in the public headers take as given.
#pragma once

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "llmt/discovery/least_squares.hpp"
#include "llmt/discovery/rounds.hpp"
#include "llmt/discovery/signals.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/discovery/terms.hpp"
#include "llmt/llmt.hpp"
#include "llmt/outliers.hpp"
#include "llmt/progress.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "llmt/size.hpp"

namespace core {

extern const Eigen::MatrixXd inputs, outputs, output, new_inputs, queries, jacobian, signature;
extern const Eigen::VectorXd t, y, residuals, weights;
extern const std::vector<std::string> words, new_words;
extern const llmt::FitResult result;
extern const llmt::Model model;
extern const llmt::discovery::Simulation spring;
extern const llmt::discovery::Inputs named;
extern const llmt::discovery::Log recorded;
extern const llmt::discovery::Verdict verdict;

}  // namespace core

#if __has_include("llmt/robotics/robotics.hpp")
#include "llmt/robotics/robotics.hpp"

namespace arm {

using namespace llmt::robotics;
extern Robot robot;
extern const Measurements measured;
extern const std::vector<Effect> rival;

}  // namespace arm
#endif
