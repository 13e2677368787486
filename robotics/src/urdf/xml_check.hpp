// What TinyXML, which recurs once per level and never ends on some texts, may be given.
#pragma once

#include <string>

namespace llmt::robotics {

/// Throws std::runtime_error `name:line:column: ...` if the text is not well-formed XML in UTF-8, has a document type
/// or a processing instruction with brackets, is nested deeper than 100 elements, or has more than 5000 links below the
/// root, 300 000 elements, comments and the like, or 100 attributes of an element.
void check_xml(const std::string& text, const std::string& name);

}  // namespace llmt::robotics
