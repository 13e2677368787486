/// \file
/// A model as C source, for controllers and instruments that run nothing else.
#pragma once

#include <string>

#include "llmt/abi.hpp"
#include "llmt/boosted_model.hpp"
#include "llmt/c_code.hpp"
#include "llmt/model.hpp"

namespace llmt {

/// Model::predict() as C99 without dependencies but <math.h>, of which only Gaussian validities call a function, exp():
/// tables and a function
///
///     int NAME_predict(const double *inputs, double *outputs);
///
/// which returns 0, or 1 and leaves `outputs` alone if an input is infinite. Everything of the model is in it: all
/// validities, oblique splits, categorical inputs (as positions of their levels, or as their codes), products, missing
/// values (NaN), guards, clamps. It allocates no memory, keeps no state, does not recurse and takes a time bounded by
/// the depth of the trees (Gaussians: by their leaves). Where the compiler neither fuses multiplications with additions
/// (GCC: -std=c99 or -ffp-contract=off) nor reorders sums (-ffast-math), the results have the bytes of
/// Model::predict(); with Gaussians, as far as exp() of the C library has.
///
/// `name` begins all names; `header_name` is what the source includes. Throws std::invalid_argument if `name` is no
/// identifier of C.
CSource to_c(const Model& model, const std::string& name, const std::string& header_name);

/// BoostedModel::predict() in the same way, with a function of the same kind and the same bytes. A sum of hundreds of
/// trees has tables of megabytes: about 100 bytes of text, and 60 of constants in the program, for a leaf and its
/// split.
CSource to_c(const BoostedModel& model, const std::string& name, const std::string& header_name);

}  // namespace llmt
