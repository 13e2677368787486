#include "report/document/page.hpp"

#include <stdexcept>

namespace llmt::report {
namespace {

constexpr std::string_view title_mark = "{{title}}";
constexpr std::string_view report_mark = "{{report}}";

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else {
      result += c;
    }
  }
  return result;
}

// JSON may write any character as an escape, and "<" begins all that could end a script.
std::string script_text(const Json& json) {
  std::string result;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<') {
      result += "\\u003c";
    } else {
      result += c;
    }
  }
  return result;
}

}  // namespace

std::string filled_page(std::string_view page, const Document& document, const std::string& origin) {
  const std::size_t title = page.find(title_mark);
  const std::size_t report = page.find(report_mark);
  if (title == std::string_view::npos || report == std::string_view::npos || report < title) {
    throw std::logic_error("the page of the reports lacks its marks");
  }
  Json json = to_json(document);
  json["origin"] = origin;
  std::string text(page.substr(0, title));
  text += escaped(document.title);
  text += page.substr(title + title_mark.size(), report - title - title_mark.size());
  text += script_text(json);
  text += page.substr(report + report_mark.size());
  return text;
}

}  // namespace llmt::report
