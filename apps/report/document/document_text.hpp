/// \file
/// A document for a terminal: its words and tables, without its pictures.
#pragma once

#include <string>

#include "report/document/document.hpp"
#include "report/text/text.hpp"

namespace llmt::report {

/// Subject, answer, lead and notes, each on a line of its own. Then each section that has words or tables, below a
/// blank line: its text, and its blocks, each with its title above it and its caption below. Tables are at most `width`
/// columns wide; sentences are not broken, which print() does.
std::string document_text(const Document& document, std::size_t width = no_width_limit);

}  // namespace llmt::report
