#include <algorithm>
#include <cstddef>
#include <vector>

#include "llmt/names.hpp"

namespace llmt {
namespace {

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Optimal string alignment distance; only the last three rows of its table are kept.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1);
  std::vector<std::size_t> last(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      const bool exchanged = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
      if (exchanged) row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

}  // namespace

std::string_view closest_name(std::string_view word, std::span<const std::string> names) {
  constexpr std::size_t longest = 200;           // beyond, nobody misspells
  constexpr std::size_t shortest_beginning = 3;  // of a name that was not written out
  std::string_view closest;
  if (word.size() > longest) return closest;
  for (const std::string& name : names) {
    if (name.size() == word.size() && distance(word, name) == 0) return name;  // but for capitals
  }
  if (word.size() < 2) return closest;
  std::size_t most = std::max<std::size_t>(1, word.size() / 3);
  for (const std::string& name : names) {
    if (name.size() > word.size() + most || word.size() > name.size() + most) continue;
    const std::size_t errors = distance(word, name);
    if (errors > most || (errors == most && !closest.empty())) continue;
    most = errors;
    closest = name;
  }
  if (!closest.empty() || word.size() < shortest_beginning) return closest;
  for (const std::string& name : names) {
    if (name.size() <= word.size() || distance(word, name.substr(0, word.size())) != 0) continue;
    if (!closest.empty()) return {};  // several begin so
    closest = name;
  }
  return closest;
}

std::string did_you_mean(std::string_view word, std::span<const std::string> names) {
  const std::string_view name = closest_name(word, names);
  return name.empty() ? std::string() : " (did you mean \"" + std::string(name) + "\"?)";
}

}  // namespace llmt
