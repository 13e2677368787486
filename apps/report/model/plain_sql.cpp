// SQL as plain_source() writes it.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "report/model/plain_text.hpp"

namespace llmt::report {
namespace {

std::string in_single_quotes(const std::string& text, char quote) {
  std::string quoted(1, quote);
  for (const char c : text) quoted += c == quote ? std::string(2, quote) : std::string(1, c);
  return quoted + quote;
}

class SqlWords : public PlainWords {
 public:
  explicit SqlWords(const std::string& table) : from_(in_single_quotes(table, '"')) {}

  std::string identifier(const std::string& wish) const override { return "llmt_" + plain_letters(wish); }
  std::set<std::string> reserved() const override { return made_; }
  std::string column(const std::string& name) const override { return in_single_quotes(name, '"'); }
  std::string known(const std::string& x, const InputColumn& input) const override {
    if (!input.is_categorical()) return x;
    if (input.codes.empty()) return fmt::format("COALESCE({}, '')", x);
    return choice(x + " IS NULL", "NULL", nearest_code(*this, x, input.codes));
  }
  std::string held(const std::string& x, double low, double high, double mean) const override {
    const double round = 0.1 * (high - low);
    const std::string per = literal(round > 0.0 ? 0.5 / round : 0.0);
    const auto square = [&](const std::string& beyond) {
      return fmt::format("({0}) - {1} * ({0}) * ({0})", beyond, per);
    };
    return fmt::format(
        "CASE WHEN {0} IS NULL THEN {1} WHEN {0} >= {2} THEN {3} WHEN {0} > {4} THEN {4} + {5} WHEN {0} <= {6} THEN "
        "{7} "
        "WHEN {0} < {8} THEN {8} - ({9}) ELSE {0} END",
        x, literal(mean), literal(high + round), literal(high + 0.5 * round), literal(high),
        square(fmt::format("{} - ({})", x, literal(high))), literal(low - round), literal(low - 0.5 * round),
        literal(low), square(fmt::format("{} - ({})", literal(low), x)));
  }
  std::string or_mean(const std::string& x, double mean) const override {
    return fmt::format("COALESCE({}, {})", x, literal(mean));
  }
  std::string choice(const std::string& condition, const std::string& yes, const std::string& no) const override {
    return fmt::format("CASE WHEN {} THEN {} ELSE {} END", condition, yes, no);
  }
  std::string among(const std::string& x, const InputColumn& input, const std::vector<int>& levels) const override {
    const auto [named, with_missing] =
        named_levels(input, levels, [](const std::string& name) { return in_single_quotes(name, '\''); });
    const std::string is_one = named.empty()
                                   ? "1 = 0"
                                   : fmt::format("{}{} IN ({})", input.codes.empty() ? "" : x + " IS NOT NULL AND ", x,
                                                 fmt::join(named, ", "));
    return with_missing ? fmt::format("({} OR {} IS NULL)", is_one, x) : is_one;
  }
  std::string is_known(const std::string& x) const override { return x + " IS NOT NULL"; }
  std::string at_most(const std::string& x, const std::string& bound, bool missing_too) const override {
    const std::string text = fmt::format("{} <= {}", x, bound);
    return missing_too ? fmt::format("({} OR {} IS NULL)", text, x) : text;
  }
  std::string negated(const std::string& condition) const override { return fmt::format("NOT ({})", condition); }

  std::string head(const std::string& model_name) const override {
    return fmt::format("-- The rules of {}, written by llmt. NULL is a missing value.\n", in_comment(model_name));
  }
  std::string if_open(const std::string& condition, int depth) const override {
    return fmt::format("{}CASE WHEN {} THEN\n", spaces(depth), condition);
  }
  std::string if_else(int depth) const override { return spaces(depth) + "ELSE\n"; }
  std::string if_close(int depth) const override { return spaces(depth) + "END\n"; }
  std::string result(const std::string& equation, int depth) const override {
    return fmt::format("{}{}\n", spaces(depth), wrapped_equation(equation, spaces(depth) + "  "));
  }
  std::string function(const std::string& target, bool is_last, const std::vector<PlainArgument>&,
                       const std::vector<PlainDefinition>& definitions, const std::string& rules) override {
    const auto with = [&](const std::string& name, const std::string& expression) {
      steps_.push_back(
          fmt::format("llmt_step_{} AS (SELECT *, {} AS {} FROM {})", steps_.size() + 1, expression, name, from_));
      from_ = fmt::format("llmt_step_{}", steps_.size());
    };
    for (const PlainDefinition& each : definitions) {
      if (made_.insert(each.name).second) with(each.name, each.expression);
    }
    const std::string name = in_single_quotes(target + "_pred", '"');
    if (!is_last) {
      with(name, "\n" + rules);
      return "";
    }
    std::string text = steps_.empty() ? "" : fmt::format("WITH\n{}\n", fmt::join(steps_, ",\n"));
    return text + fmt::format("SELECT *,\n{}  AS {}\nFROM {};\n", rules, name, from_);
  }

 private:
  std::string from_;
  std::vector<std::string> steps_;
  std::set<std::string> made_;
};

}  // namespace

std::unique_ptr<PlainWords> sql_words(const std::string& table) { return std::make_unique<SqlWords>(table); }

}  // namespace llmt::report
