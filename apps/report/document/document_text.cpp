#include "report/document/document_text.hpp"

namespace llmt::report {
namespace {

std::string own_line(const std::string& text) { return text.empty() || text.ends_with('\n') ? text : text + "\n"; }

std::string table_text(const Json& grid, std::size_t width) {
  Table table(grid["header"].get<std::vector<std::string>>());
  for (const Json& row : grid["rows"]) table.add(row.get<std::vector<std::string>>());
  return table.text(width);
}

// Nothing for a picture that no table stands for.
std::string block_text(const Json& block, std::size_t width) {
  if (block.contains("in_words")) return block_text(block["in_words"], width);
  const std::string title = block.value("title", "");
  std::string text = own_line(title);
  if (block["kind"] == "table") {
    text += table_text(block, width);
  } else if (block["kind"] == "text") {
    for (const Json& each : block["lines"]) text += (title.empty() ? "" : "  ") + own_line(each.get<std::string>());
  } else {
    return "";
  }
  return text + own_line(block.value("caption", ""));
}

std::string section_text(const std::string& head, const std::vector<Json>& blocks, std::size_t width) {
  std::string text;
  for (const Json& each : blocks) {
    const std::string of_block = block_text(each, width);
    if (of_block.empty()) continue;
    const bool has_title = !each.value("title", "").empty();
    text += (has_title && !text.empty() ? "\n" : "") + of_block;
  }
  return text.empty() ? "" : "\n" + own_line(head) + text;
}

}  // namespace

std::string document_text(const Document& document, std::size_t width) {
  std::string text = own_line(document.subject) + own_line(document.answer) + own_line(document.lead);
  for (const std::string& note : document.notes) text += own_line(note);
  text += section_text("", document.beside_main, width);
  for (const Section& section : document.sections) text += section_text(section.text, section.blocks, width);
  return text;
}

}  // namespace llmt::report
