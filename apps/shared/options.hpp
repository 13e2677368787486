/// \file
/// The options that both programs offer: numbers with the range they keep, files with the part they play. run() refuses
/// to start a program with an option that takes a number and has no range.
#pragma once

#include <CLI/CLI.hpp>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/csv.hpp"
#include "llmt/option_fields.hpp"

namespace llmt::apps {

/// An option with a number, shown as NUMBER. Reading it throws std::invalid_argument that names option, text and range,
/// if the text is no number or outside the range.
CLI::Option* add_number(CLI::App& command, const std::string& name, double& value, const NumberRange& range,
                        const std::string& help);

/// The same with several numbers, separated by commas.
CLI::Option* add_numbers(CLI::App& command, const std::string& name, std::vector<double>& values,
                         const NumberRange& range, const std::string& help);

/// A number in the range; throws as add_number().
double read_number(const std::string& option, const std::string& text, const NumberRange& range);

/// A whole number in [low, high]; throws as add_number().
std::int64_t read_count(const std::string& option, const std::string& text, std::int64_t low, std::int64_t high);

/// As CLI::App::add_option() without a type.
CLI::Option* add_text(CLI::App& command, const std::string& name, const char* type, const CLI::callback_t& take,
                      const std::string& help, const std::function<std::string()>& show);

/// An option with a whole number from `low` to `high`, shown as COUNT.
template <std::signed_integral Whole>
CLI::Option* add_count(CLI::App& command, const std::string& name, Whole& value, Whole low, const std::string& help,
                       Whole high = std::numeric_limits<Whole>::max()) {
  const auto take = [name, &value, low, high](const CLI::results_t& texts) {
    value = static_cast<Whole>(read_count(name, texts.back(), low, high));
    return true;
  };
  return add_text(command, name, "COUNT", take, help, [&value] { return std::to_string(value); });
}

/// --folds: 0, or 2 and more.
CLI::Option* add_folds(CLI::App& command, int& folds, const std::string& help);

/// An option with names of columns or the like, as names_in() or given one by one; `type` is shown as "TYPE,...".
CLI::Option* add_names(CLI::App& command, const std::string& name, std::vector<std::string>& values, const char* type,
                       const std::string& help);

/// Names separated by commas. One that holds a comma stands in double quotes, inner quotes doubled, as in CSV.
std::vector<std::string> names_in(const std::string& text);

/// The seed of random numbers, from 0 to 2^64 - 1.
CLI::Option* add_seed(CLI::App& command, std::uint64_t& seed, const std::string& help);

/// --threads; the default is shown.
CLI::Option* add_threads(CLI::App& command, int& threads);

/// --decimal-comma: the numbers of the command's tables have a decimal comma.
inline constexpr const char* decimal_comma_option = "--decimal-comma";
CLI::Option* add_decimal_comma(CLI::App& command, DecimalMark& mark);

/// --thousands: numbers of the command's tables may have separators of thousands.
inline constexpr const char* thousands_option = "--thousands";
CLI::Option* add_thousands(CLI::App& command, bool& thousands);

/// A file that the command reads, shown as FILE. A dash is standard input where the command says so.
CLI::Option* add_input_file(CLI::App& command, const std::string& name, std::string& path, const std::string& help);

/// One file or more; the last of the positional arguments.
CLI::Option* add_input_files(CLI::App& command, const std::string& name, std::vector<std::string>& paths,
                             const std::string& help);

/// The file that the command writes, shown as NEWFILE. It is checked before the command runs. Throws
/// std::invalid_argument if it is one of the input files or another output, by whatever name or link, and
/// std::runtime_error if it is a folder or lies in none. Devices and pipes may be named twice. `extensions`: of further
/// files that are written beside it under its name.
CLI::Option* add_output_file(CLI::App& command, const std::string& name, std::string& path, const std::string& help,
                             const std::vector<std::string>& extensions = {});

/// The checks of add_output_file() for a path that is known later. `name`: of its option, "--output".
void check_output_file(const CLI::App& command, const std::string& name, const std::string& path,
                       const std::vector<std::string>& extensions = {});

/// The files that the command which was called reads, as they were named.
std::vector<std::string> input_files(const CLI::App& app);

/// The check above for an input that is known only when another one has been read.
void refuse_lost_input(const std::string& output, const std::string& input);

/// FILE of a file written beside `path`: the same name with another extension.
std::filesystem::path beside(const std::string& path, const std::string& extension);

/// Throws std::invalid_argument that the two files seem to be exchanged, and the `order` that they come in.
[[noreturn]] void refuse_exchanged(const std::string& first, const std::string& second, const char* order);

/// read(first). Where that throws although read(second) does not, the two were exchanged: std::invalid_argument says
/// so, and the `order` that they come in.
template <class Read>
auto read_unless_exchanged(const std::string& first, const std::string& second, const char* order, const Read& read) {
  try {
    return read(first);
  } catch (const std::runtime_error&) {
    bool exchanged = true;
    try {
      read(second);
    } catch (const std::exception&) {
      exchanged = false;
    }
    if (!exchanged) throw;
  }
  refuse_exchanged(first, second, order);
}

/// Throws std::logic_error if a command has an option with a number that add_number(), add_count() and the like did not
/// make.
void require_ranges(const CLI::App& app);

}  // namespace llmt::apps
