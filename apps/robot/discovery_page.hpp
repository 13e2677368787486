/// \file
/// A discovery as a page of text and as JSON.
#pragma once

#include <string>

#include "llmt/robotics/discovery.hpp"
#include "shared/cli.hpp"

namespace llmt::apps {

/// What was found, in the words of an engineer who has to act on it.
std::string discovery_page(const robotics::Discovery& found);

Json discovery_json(const robotics::Discovery& found);

}  // namespace llmt::apps
