/// \file
/// All of LLMT but llmt::discovery: fit(), Model, Stream, compare(), explain, CSV.
///
///     const llmt::Model learnt = llmt::fit(inputs, outputs, {.validity = llmt::ValidityChoice::crisp}).model;
///     for (const llmt::Leaf& leaf : learnt.leaves(0)) std::printf("%td rows\n", leaf.samples);
#pragma once

#include "llmt/arrow.hpp"
#include "llmt/boosted.hpp"
#include "llmt/boosted_explain.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/c_source.hpp"
#include "llmt/compare.hpp"
#include "llmt/csv.hpp"
#include "llmt/distributed.hpp"
#include "llmt/explain.hpp"
#include "llmt/files.hpp"
#include "llmt/finding.hpp"
#include "llmt/fit.hpp"
#include "llmt/fit_result.hpp"
#include "llmt/folds.hpp"
#include "llmt/intervals.hpp"
#include "llmt/limits.hpp"
#include "llmt/model.hpp"
#include "llmt/names.hpp"
#include "llmt/option_fields.hpp"
#include "llmt/options.hpp"
#include "llmt/outliers.hpp"
#include "llmt/partition.hpp"
#include "llmt/progress.hpp"
#include "llmt/random.hpp"
#include "llmt/readable.hpp"
#include "llmt/size.hpp"
#include "llmt/statistics.hpp"
#include "llmt/stream.hpp"
#include "llmt/stream_options.hpp"
#include "llmt/summary.hpp"
#include "llmt/teach.hpp"
#include "llmt/training_data.hpp"
