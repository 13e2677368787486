#include "llmt/finding.hpp"

#include <algorithm>
#include <utility>

namespace llmt {

std::string numbered(std::string_view noun, const std::vector<Eigen::Index>& numbers, std::size_t most) {
  std::string text = std::string(noun) + (numbers.size() == 1 ? "" : "s");
  for (std::size_t k = 0; k < std::min(most, numbers.size()); ++k) {
    text += (k == 0 ? " " : ", ") + std::to_string(numbers[k]);
  }
  return text + (numbers.size() > most ? ", ..." : "");
}

std::string Face::option(std::string_view name) const {
  std::string words(name);
  std::ranges::replace(words, '-', between_words);
  return before_option + words;
}

std::string Face::rows(const std::vector<Eigen::Index>& lines, std::size_t most) const {
  if (!in_memory) return numbered("line", lines, most);
  std::vector<Eigen::Index> counted = lines;
  for (Eigen::Index& line : counted) line -= 2;
  return numbered("row", counted, most);
}

std::string Face::table(const std::string& name) const {
  return in_memory && name.starts_with('<') && name.ends_with('>') ? name.substr(1, name.size() - 2) : name;
}

std::string Face::place(const std::string& name, Eigen::Index line) const {
  return in_memory ? table(name) + ", row " + std::to_string(line - 2) : name + ":" + std::to_string(line);
}

Finding finding(std::string code, std::string sentence) {
  return {std::move(code), [said = std::move(sentence)](const Face&) { return said; }};
}

std::vector<std::string> words(const std::vector<Finding>& findings, const Face& face) {
  std::vector<std::string> sentences;
  for (const Finding& each : findings) sentences.push_back(each.words(face));
  return sentences;
}

}  // namespace llmt
