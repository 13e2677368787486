// Expressions. Inputs that begin with a control character build an expression whose value is known; others are texts as
// they stand.
#include "expressions/expression.hpp"

#include <cmath>

#include "fuzz/fuzz.hpp"

namespace fuzz_expression {
namespace {

constexpr double rounding = 1e-15;

// A value and a bound of its error, for the parser may take other ways of the same algebra. `sure`: no comparison was
// so close that rounding decides it.
struct Value {
  double value;
  double error;
  bool sure = true;
};

struct Built {
  std::string text;
  Value value;
  int precedence;  // of the outermost operator
};

constexpr int atom = 9;

Built wrapped(const Built& part, bool needed) { return needed ? Built{"(" + part.text + ")", part.value, atom} : part; }

Value arithmetic(const Value& a, const Value& b, char sign) {
  const double x = std::abs(a.value);
  const double y = std::abs(b.value);
  Value result{0.0, 0.0, a.sure && b.sure};
  if (sign == '+' || sign == '-') {
    result.value = sign == '+' ? a.value + b.value : a.value - b.value;
    result.error = a.error + b.error + rounding * (x + y);
  } else if (sign == '*') {
    result.value = a.value * b.value;
    result.error = a.error * y + b.error * x + a.error * b.error + rounding * x * y;
  } else {
    result.value = a.value / b.value;
    const double least = y - b.error;
    result.error = least > 0.0 ? (a.error + b.error * x / y) / least + rounding * x / y : INFINITY;
  }
  return result;
}

Value comparison(const Value& a, const Value& b, const std::string& sign) {
  const double gap = std::abs(a.value - b.value);
  const bool holds = sign == "<"    ? a.value < b.value
                     : sign == ">"  ? a.value > b.value
                     : sign == "<=" ? a.value <= b.value
                     : sign == ">=" ? a.value >= b.value
                     : sign == "==" ? a.value == b.value
                                    : a.value != b.value;
  const double errors = a.error + b.error;
  return {holds ? 1.0 : 0.0, 0.0, a.sure && b.sure && (errors == 0.0 || gap > errors)};
}

class Builder {
 public:
  Builder(fuzz::Bytes& bytes, const std::vector<std::string>& names, const std::vector<double>& values)
      : bytes_(bytes), names_(names), values_(values) {}

  Built build(int depth) {
    if (depth == 0 || bytes_.empty()) return leaf();
    switch (bytes_.below(8)) {
      case 0:
      case 1:
        return sum(depth, bytes_.coin() ? '+' : '-');
      case 2:
        return product(depth, bytes_.coin() ? '*' : '/');
      case 3:
        return compared(depth);
      case 4:
        return choice(depth);
      case 5:
        return negative(depth);
      case 6:
        return function(depth);
      default:
        return leaf();
    }
  }

 private:
  fuzz::Bytes& bytes_;
  const std::vector<std::string>& names_;
  const std::vector<double>& values_;

  std::string blank() { return bytes_.byte() % 4 == 0 ? " " : ""; }

  Built leaf() {
    if (bytes_.coin()) {
      const int name = bytes_.below(static_cast<int>(names_.size()));
      return {names_[name], {values_[name], 0.0}, atom};
    }
    const double value = static_cast<double>(bytes_.below(1000)) / 8.0;
    return {fmt::format("{}", value), {value, 0.0}, atom};
  }

  Built sum(int depth, char sign) {
    const Built a = build(depth - 1);
    const Built b = build(depth - 1);
    const Built left = wrapped(a, a.precedence < 5);
    const Built right = wrapped(b, b.precedence <= 5 || bytes_.coin());
    return {left.text + blank() + sign + blank() + right.text, arithmetic(left.value, right.value, sign), 5};
  }

  Built product(int depth, char sign) {
    const Built a = build(depth - 1);
    const Built b = build(depth - 1);
    const Built left = wrapped(a, a.precedence < 6);
    const Built right = wrapped(b, b.precedence <= 6 || bytes_.coin());
    return {left.text + blank() + sign + blank() + right.text, arithmetic(left.value, right.value, sign), 6};
  }

  Built compared(int depth) {
    static const std::vector<std::string> signs = {"<", ">", "<=", ">=", "==", "!="};
    const Built a = build(depth - 1);
    const Built b = build(depth - 1);
    const std::string& sign = bytes_.one_of(signs);
    return {
        "(" + wrapped(a, a.precedence < 5).text + blank() + sign + blank() + wrapped(b, b.precedence < 5).text + ")",
        comparison(a.value, b.value, sign), atom};
  }

  Built choice(int depth) {
    const Built condition = compared(depth);
    const Built a = build(depth - 1);
    const Built b = build(depth - 1);
    Value value = condition.value.value != 0.0 ? a.value : b.value;
    value.sure = a.value.sure && b.value.sure && condition.value.sure;
    return {"(" + condition.text + " ? " + a.text + blank() + ":" + blank() + b.text + ")", value, atom};
  }

  Built negative(int depth) {
    const Built a = build(depth - 1);
    return {"(-" + wrapped(a, a.precedence < atom).text + ")", {-a.value.value, a.value.error, a.value.sure}, atom};
  }

  Built function(int depth) {
    const Built a = build(depth - 1);
    const auto of = [&](const char* name, double value, double slope) {
      // Beyond 1e6 an error of the argument turns a wave.
      const bool sure = a.value.sure && std::abs(a.value.value) < 1e6;
      return Built{fmt::format("{}({})", name, a.text),
                   {value, slope * a.value.error + 4.0 * rounding * (1.0 + std::abs(value)), sure},
                   atom};
    };
    switch (bytes_.below(4)) {
      case 0:
        return of("sin", std::sin(a.value.value), 1.0);
      case 1:
        return of("cos", std::cos(a.value.value), 1.0);
      case 2:
        return of("abs", std::abs(a.value.value), 1.0);
      default: {
        const Built b = build(depth - 1);
        Value value = std::max(a.value.value, b.value.value) == a.value.value ? a.value : b.value;
        value.error = std::max(a.value.error, b.value.error);
        value.sure = a.value.sure && b.value.sure;
        return {"max(" + a.text + "," + blank() + b.text + ")", value, atom};
      }
    }
  }
};

void compare_with_reference(fuzz::Bytes& bytes) {
  const std::vector<std::string> names = {"a", "b", "q1"};
  std::vector<double> values;
  for (std::size_t k = 0; k < names.size(); ++k) values.push_back(bytes.ordinary());
  const Built built = Builder(bytes, names, values).build(5);
  if (built.text.size() > llmt::Expression::longest) return;
  llmt::Expression expression(built.text);
  std::vector<double> own;
  for (const std::string& name : expression.names()) own.push_back(values[name == "a" ? 0 : name == "b" ? 1 : 2]);
  const double value = expression.value(own);
  fuzz::require(expression.value(own) == value || std::isnan(value), built.text + " has the same value each time");
  const Value& expected = built.value;
  if (!expected.sure || !std::isfinite(expected.value) || !std::isfinite(expected.error)) return;
  fuzz::require(std::abs(value - expected.value) <= expected.error,
                fmt::format("{} is {} +- {}, not {}", built.text, expected.value, expected.error, value));
}

}  // namespace

FUZZ_TARGET(expression) {
  if (size > 0 && data[0] < ' ') {
    fuzz::Bytes bytes(data + 1, size - 1);
    compare_with_reference(bytes);
    return 0;
  }
  try {
    llmt::Expression expression(fuzz::text_of(data, size));
    const std::vector<double> values(expression.names().size(), 0.5);
    const double first = expression.value(values);
    const double second = expression.value(values);
    fuzz::require(first == second || (std::isnan(first) && std::isnan(second)), "an expression changes no variable");
  } catch (const llmt::ExpressionError& error) {
    fuzz::require(std::string(error.what()).size() < 500, "a message is no copy of the text");
  }
  return 0;
}

}  // namespace fuzz_expression
