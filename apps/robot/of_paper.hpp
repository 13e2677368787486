/// \file
/// The reports of `llmt-robot paper`: the figures of Benes et al. 2022 made new.
#pragma once

#include <cstdint>
#include <vector>

#include "report/document/document.hpp"
#include "robot/planar_study.hpp"
#include "robot/tx200_study.hpp"

namespace llmt::apps {

/// Figures 4 to 10 of the planar arm, and 12 and 13 of a simulated arm. The first study is the one with carry-over.
report::Document planar_report(const std::vector<PlanarStudy>& studies, const Tx200Run& simulated);

/// What 45 poses are worth: figures 12 and 13 of the first simulated data set, and the errors of all.
report::Document tx200_report(const std::vector<Tx200Trial>& trials, const Tx200Run& first, std::uint64_t first_seed);

}  // namespace llmt::apps
