/// \file
/// The page that draws a report. Programs are built with it where `cmake/setup report` fetched what it is made from.
#pragma once

#include <string>
#include <string_view>

#include "report/document/document.hpp"

namespace llmt::report {

/// The page without data, or nothing in a build without it.
std::string_view empty_page();

/// One HTML file that holds all it needs. `origin`: who made it from what. Text of `page` outside the marks stays as
/// it is; the data cannot end the element that holds them.
std::string filled_page(std::string_view page, const Document& document, const std::string& origin);

}  // namespace llmt::report
