// Terms of the same inputs that together stand for another function of them.
#pragma once

#include <string>
#include <vector>

#include "discovery/terms/term_model.hpp"
#include "llmt/discovery/missing.hpp"

namespace llmt::discovery {

std::vector<std::string> sorted_inputs(const FoundTerm& found);

/// Of each term found, whether it and others may only approximate one that was not tried: three or more kinds of one
/// input (in time, two of which one has a rival of that input), or two terms of the same two inputs. A term for which
/// an offset could stand counts, in time, as one of each input of which a function could stand for it too.
std::vector<bool> approximations(const std::vector<FoundTerm>& all, bool in_time);

/// Of each term found: whether it and others of the same inputs nearly cancel, sum_k |c_k|^2 > 10 |sum_k c_k|^2, c_k
/// what term k adds at the samples. What is left of them is another function, as the peak that sign - tanh makes.
std::vector<bool> cancelling_terms(const TermModel& model, const TermData& data, const Eigen::VectorXd& parameters,
                                   const std::vector<FoundTerm>& found);

}  // namespace llmt::discovery
