#include "llmt/lags.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>

#include "llmt/names.hpp"

namespace llmt {
namespace {

[[noreturn]] void refuse_part(std::string_view part, const std::string& why) {
  throw std::invalid_argument(fmt::format("lags: \"{}\": {}", part, why));
}

int lag_from(std::string_view text, std::string_view part) {
  int lag = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), lag);
  if (error != std::errc() || end != text.data() + text.size() || text.empty() || text.front() == '-') {
    refuse_part(part, "NAME:LAG or NAME:FIRST-LAST is needed, such as y:1-3");
  }
  if (lag > most_lag) refuse_part(part, fmt::format("a lag is at most {}", most_lag));
  return lag;
}

std::string no_such(const char* what, std::string_view name, const std::vector<std::string>& names) {
  return fmt::format("there is no {} \"{}\"{}; there are {}", what, name, did_you_mean(name, names),
                     fmt::join(names, ", "));
}

// "1,2,3,5" as "1-3,5" with the name before each.
void append_lags(std::string& text, const std::string& name, const std::vector<int>& lags, bool adds_up = false) {
  for (std::size_t k = 0; k < lags.size();) {
    std::size_t last = k;
    while (last + 1 < lags.size() && lags[last + 1] == lags[last] + 1) ++last;
    text += fmt::format("{}{}:{}{}", text.empty() ? "" : ",", name, adds_up && k == 0 ? "+" : "", lags[k]);
    if (last > k) text += fmt::format("-{}", lags[last]);
    k = last + 1;
  }
}

}  // namespace

Lags parse_lags(std::string_view text, const std::vector<std::string>& inputs,
                const std::vector<std::string>& outputs) {
  Lags lags{std::vector<std::vector<int>>(outputs.size()), std::vector<std::vector<int>>(inputs.size())};
  std::string_view rest = text;
  while (true) {
    const std::size_t comma = rest.find(',');
    const std::string_view part = rest.substr(0, comma);
    const std::size_t colon = part.rfind(':');
    if (colon == std::string_view::npos) refuse_part(part, "NAME:LAG or NAME:FIRST-LAST is needed, such as y:1-3");
    const std::string_view name = part.substr(0, colon);
    std::string_view range = part.substr(colon + 1);
    const bool adds_up = range.starts_with('+');
    if (adds_up) range.remove_prefix(1);
    const std::size_t dash = range.find('-');
    const int first = lag_from(range.substr(0, dash), part);
    const int last = dash == std::string_view::npos ? first : lag_from(range.substr(dash + 1), part);
    if (last < first) refuse_part(part, "the range ends before it begins");
    const auto output = std::ranges::find(outputs, name);
    const auto input = std::ranges::find(inputs, name);
    if (output == outputs.end() && input == inputs.end()) {
      std::vector<std::string> all = outputs;
      all.insert(all.end(), inputs.begin(), inputs.end());
      refuse_part(part, no_such("input or output", name, all));
    }
    std::vector<int>& list =
        output != outputs.end() ? lags.outputs[output - outputs.begin()] : lags.inputs[input - inputs.begin()];
    if (output != outputs.end() && first == 0) refuse_part(part, "lags of outputs begin at 1");
    if (adds_up) {
      if (output == outputs.end()) refuse_part(part, "only an output adds up its changes");
      lags.adds_up.resize(outputs.size());
      lags.adds_up[output - outputs.begin()] = true;
    }
    for (int lag = first; lag <= last; ++lag) list.push_back(lag);
    if (comma == std::string_view::npos) break;
    rest = rest.substr(comma + 1);
  }
  for (auto* lists : {&lags.outputs, &lags.inputs}) {
    for (std::vector<int>& list : *lists) {
      std::ranges::sort(list);
      list.erase(std::ranges::unique(list).begin(), list.end());
    }
  }
  check_lags(lags);
  return lags;
}

std::vector<int> parse_delays(std::string_view text, const std::vector<std::string>& inputs, int otherwise) {
  std::vector<int> delays(inputs.size(), otherwise);
  std::vector<bool> named(inputs.size(), false);
  const auto refuse = [](std::string_view part, const std::string& why) {
    throw std::invalid_argument(fmt::format("delay: \"{}\": {}", part, why));
  };
  std::string_view rest = text;
  while (true) {
    const std::size_t comma = rest.find(',');
    const std::string_view part = rest.substr(0, comma);
    const std::size_t colon = part.rfind(':');
    const std::string_view number = colon == std::string_view::npos ? std::string_view() : part.substr(colon + 1);
    int delay = -1;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), delay);
    if (error != std::errc() || end != number.data() + number.size() || delay < 0 || delay > most_lag) {
      refuse(part, fmt::format("auto, or INPUT:ROWS with 0 to {} rows is needed, such as u:3", most_lag));
    }
    const auto input = std::ranges::find(inputs, part.substr(0, colon));
    if (input == inputs.end()) refuse(part, no_such("input", part.substr(0, colon), inputs));
    const auto place = static_cast<std::size_t>(input - inputs.begin());
    if (named[place]) refuse(part, "the input has a delay already");
    named[place] = true;
    delays[place] = delay;
    if (comma == std::string_view::npos) return delays;
    rest = rest.substr(comma + 1);
  }
}

Lags delayed(Lags lags, const std::vector<int>& delays) {
  for (std::size_t i = 0; i < lags.inputs.size(); ++i) {
    for (int& lag : lags.inputs[i]) lag += delays[i];
  }
  return lags;
}

std::string text_of(const Lags& lags, const std::vector<std::string>& inputs, const std::vector<std::string>& outputs) {
  std::string text;
  for (std::size_t o = 0; o < lags.outputs.size(); ++o)
    append_lags(text, outputs[o], lags.outputs[o], adds_up(lags, o));
  for (std::size_t i = 0; i < lags.inputs.size(); ++i) append_lags(text, inputs[i], lags.inputs[i]);
  return text;
}

void check_lags(const Lags& lags) {
  const auto check = [&](const std::vector<int>& list, int least) {
    int before = least - 1;
    for (const int lag : list) {
      if (lag <= before || lag > most_lag) {
        throw std::invalid_argument(
            fmt::format("lags: {} is no lag here; they ascend from {} to at most {}", lag, least, most_lag));
      }
      before = lag;
    }
  };
  for (const std::vector<int>& list : lags.outputs) check(list, 1);
  for (const std::vector<int>& list : lags.inputs) check(list, 0);
  if (!lags.adds_up.empty() && lags.adds_up.size() != lags.outputs.size()) {
    throw std::invalid_argument("lags: it is said of some outputs only whether they add up");
  }
  for (std::size_t o = 0; o < lags.outputs.size(); ++o) {
    if (adds_up(lags, o) && (lags.outputs[o].empty() || lags.outputs[o].front() != 1)) {
      throw std::invalid_argument("lags: those of an output that adds up begin at 1");
    }
  }
  const Eigen::Index count = std::ssize(columns_of(lags));
  if (count == 0) throw std::invalid_argument("lags: there are none");
  if (count > most_lagged_columns) {
    throw std::invalid_argument(fmt::format("lags: there are {}, at most {} are taken", count, most_lagged_columns));
  }
}

bool adds_up(const Lags& lags, Eigen::Index output) { return !lags.adds_up.empty() && lags.adds_up[output]; }

Eigen::Index longest_lag(const Lags& lags) {
  int longest = 0;
  for (const auto* lists : {&lags.outputs, &lags.inputs}) {
    for (const std::vector<int>& list : *lists) {
      if (!list.empty()) longest = std::max(longest, list.back());
    }
  }
  return longest;
}

std::vector<LaggedColumn> columns_of(const Lags& lags) {
  std::vector<LaggedColumn> columns;
  for (int o = 0; o < std::ssize(lags.outputs); ++o) {
    const std::vector<int>& list = lags.outputs[o];
    for (std::size_t k = adds_up(lags, o) ? 1 : 0; k < list.size(); ++k) {
      columns.push_back({true, o, k == 0 ? list[0] : list[k - 1], k == 0 ? -1 : list[k]});
    }
  }
  for (int i = 0; i < std::ssize(lags.inputs); ++i) {
    for (const int lag : lags.inputs[i]) columns.push_back({false, i, lag, -1});
  }
  return columns;
}

std::vector<std::string> column_names(const std::vector<LaggedColumn>& columns, const std::vector<std::string>& inputs,
                                      const std::vector<std::string>& outputs) {
  std::vector<std::string> names;
  for (const LaggedColumn& column : columns) {
    const std::string& signal = column.is_output ? outputs[column.signal] : inputs[column.signal];
    const auto at = [&](int lag) { return lag == 0 ? signal + "(t)" : fmt::format("{}(t-{})", signal, lag); };
    names.push_back(column.minus_lag < 0 ? at(column.lag) : at(column.lag) + "-" + at(column.minus_lag));
  }
  return names;
}

}  // namespace llmt
