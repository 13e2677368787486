/// \file
/// A discovery as a page of text and as JSON.
#pragma once

#include <string>

#include "llmt/robotics/discovery/discovery.hpp"
#include "report/text/json.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// What was found, in the words of an engineer who has to act on it: at most 24 lines of at most 100 columns, or
/// `width` if that is less, then details. `lines_of_file`: of the measurements, row by row, which `face` names.
std::string discovery_page(const robotics::Discovery& found, const std::vector<Eigen::Index>& lines_of_file,
                           std::size_t width = no_width_limit, const Face& face = {});

/// Everything else that is known: values, patterns, where the gap is, what could not be tested.
std::string discovery_details(const robotics::Discovery& found);

/// The values of an effect that the data determine, with their errors.
std::string effect_values(const robotics::Discovery& found, const robotics::FoundEffect& effect);

Json discovery_json(const robotics::Discovery& found);

}  // namespace llmt::report
