#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <stdexcept>

#include "report/terms/found_terms.hpp"
#include "report/text/text.hpp"

namespace llmt::report {
namespace {

// A name in a comment: nothing in it ends the comment.
std::string harmless(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const bool is_plain = c >= ' ' && c <= '~' && c != '\\' && !(c == '/' && result.ends_with('*'));
    result += is_plain ? c : '_';
  }
  return result;
}

// What the function of one output is made of.
struct Body {
  std::string name;
  std::vector<std::string> arguments;
  std::vector<std::pair<std::string, double>> zero_bands;  // arguments that count as 0 below
  std::vector<FoundTerms::Input> held;                     // arguments that are held between low and high
  std::string adjusted;                                    // what is done to the simulated value first; empty: nothing
  std::vector<std::string> summands;
  std::vector<std::string> titles;
  std::optional<std::pair<double, double>> range;  // that the sum of the summands is held to
};

Body body_of(const FoundTerms& found, std::size_t o, CodeLanguage language) {
  const FoundTerms::Output& output = found.outputs[o];
  Body body;
  body.name = found.outputs.size() == 1 ? "correction" : "correction_" + output.word;
  for (const FoundTerms::Input& input : found.inputs) {
    body.arguments.push_back(input.word);
    if (input.zero_band > 0.0) body.zero_bands.emplace_back(input.word, input.zero_band);
    if (found.is_held) body.held.push_back(input);
  }
  if (output.is_held()) body.range = {output.terms_low, output.terms_high};
  std::vector<std::string> variables = body.arguments;
  variables.push_back(output.word);
  bool uses_output = false;
  if (output.offset != 0.0 || output.scale != 1.0) {
    body.adjusted = fmt::format("{} + {} * {}", output.offset, output.scale - 1.0, output.word);
    uses_output = true;
  }
  for (const FoundTerms::Term& term : found.terms) {
    if (term.output != o) continue;
    if (term.expression.empty()) {
      throw std::runtime_error(
          fmt::format("{}: the term {} cannot be written as code: {}", found.file, term.title,
                      term.location.empty() ? "it has no expression" : "it depends on other rows than its own"));
    }
    try {
      body.summands.push_back(translated(term.expression, variables, language));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: the term {}: {}", found.file, term.title, error.what()));
    }
    body.titles.push_back(harmless(term.title));
    // Words of an expression are whole words of its translation.
    const std::string& text = term.expression;
    for (std::size_t at = text.find(output.word); at != std::string::npos; at = text.find(output.word, at + 1)) {
      const auto is_word = [&](std::size_t k) {
        return k < text.size() && (std::isalnum(static_cast<unsigned char>(text[k])) != 0 || text[k] == '_');
      };
      uses_output = uses_output || (!is_word(at - 1) && !is_word(at + output.word.size()));
    }
  }
  if (uses_output) body.arguments.push_back(output.word);
  return body;
}

std::vector<std::string> comments_of(const FoundTerms& found) {
  std::vector<std::string> lines = {"What is to be added to the simulated output, found by llmt discover."};
  for (const FoundTerms::Input& input : found.inputs) {
    if (input.word != input.name)
      lines.push_back(fmt::format("{} is the input \"{}\".", input.word, harmless(input.name)));
  }
  for (const FoundTerms::Output& output : found.outputs) {
    if (output.word != output.name) {
      lines.push_back(fmt::format("{} is the simulated \"{}\".", output.word, harmless(output.name)));
    }
  }
  for (const FoundTerms::Change& change : found.changes) {
    lines.push_back(change.value.is_null()
                        ? fmt::format("Beside it the parameter {} of the simulation changes by {} {}.",
                                      harmless(change.parameter), number(change.change), harmless(change.unit))
                        : fmt::format("Beside it the parameter {} of the simulation is set to {} {}.",
                                      harmless(change.parameter), number(change.value.get<double>()),
                                      harmless(change.unit)));
  }
  return lines;
}

std::string c_function(const Body& body) {
  std::vector<std::string> arguments;
  for (const std::string& argument : body.arguments) arguments.push_back("double " + argument);
  std::string text = fmt::format("\ndouble {}({}) {{\n", body.name, fmt::join(arguments, ", "));
  for (const auto& [word, band] : body.zero_bands) {
    text += fmt::format("  if (fabs({0}) < {1}) {0} = 0.0; /* at rest */\n", word, band);
  }
  for (const FoundTerms::Input& input : body.held) {
    // What is not a number stays so.
    text += fmt::format("  {0} = {0} < {1} ? {1} : {0} > {2} ? {2} : {0}; /* as far as it was seen */\n", input.word,
                        input.low, input.high);
  }
  text += fmt::format("  double change = {};\n", body.adjusted.empty() ? "0.0" : body.adjusted);
  if (!body.adjusted.empty()) text += fmt::format("  {} += change;\n", body.arguments.back());
  const char* const sum = body.range ? "terms" : "change";
  if (body.range) text += "  double terms = 0.0;\n";
  for (std::size_t k = 0; k < body.summands.size(); ++k) {
    text += fmt::format("  {} += {}; /* {} */\n", sum, body.summands[k], body.titles[k]);
  }
  if (body.range) {
    text += fmt::format("  change += terms < {0} ? {0} : terms > {1} ? {1} : terms; /* as far as it was seen */\n",
                        body.range->first, body.range->second);
  }
  for (const std::string& argument : body.arguments) text += fmt::format("  (void){};\n", argument);
  return text + "  return change;\n}\n";
}

std::string python_function(const Body& body) {
  std::string text = fmt::format("\n\ndef {}({}):\n", body.name, fmt::join(body.arguments, ", "));
  for (const auto& [word, band] : body.zero_bands) {
    text += fmt::format("    {0} = np.where(np.abs({0}) < {1}, 0.0, {0})  # at rest\n", word, band);
  }
  for (const FoundTerms::Input& input : body.held) {
    text +=
        fmt::format("    {0} = np.clip({0}, {1}, {2})  # as far as it was seen\n", input.word, input.low, input.high);
  }
  text += fmt::format("    change = {}\n", body.adjusted.empty() ? "0.0" : body.adjusted);
  if (!body.adjusted.empty()) text += fmt::format("    {0} = {0} + change\n", body.arguments.back());
  const char* const sum = body.range ? "terms" : "change";
  if (body.range) text += "    terms = 0.0\n";
  for (std::size_t k = 0; k < body.summands.size(); ++k) {
    text += fmt::format("    {0} = {0} + {1}  # {2}\n", sum, body.summands[k], body.titles[k]);
  }
  if (body.range) {
    text += fmt::format("    change = change + np.clip(terms, {}, {})  # as far as it was seen\n", body.range->first,
                        body.range->second);
  }
  return text + "    return change\n";
}

}  // namespace

std::string correction_code(const FoundTerms& found, CodeLanguage language) {
  const bool is_c = language == CodeLanguage::c;
  std::string functions;
  for (std::size_t o = 0; o < found.outputs.size(); ++o) {
    const Body body = body_of(found, o, language);
    functions += is_c ? c_function(body) : python_function(body);
  }
  std::string text;
  for (const std::string& line : comments_of(found))
    text += is_c ? fmt::format("/* {} */\n", line) : fmt::format("# {}\n", line);
  text += is_c ? "#include <math.h>\n" : "import numpy as np\n";
  if (functions.find("llmt_sign(") != std::string::npos) {
    text += "\nstatic double llmt_sign(double x) { return (x > 0.0) - (x < 0.0); }\n";
  }
  return text + functions;
}

}  // namespace llmt::report
