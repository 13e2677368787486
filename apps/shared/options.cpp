#include "shared/options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <stdexcept>

#include "llmt/limits.hpp"

namespace llmt::apps {
namespace {

constexpr const char* input_type = "FILE";
constexpr const char* output_type = "NEWFILE";

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& words) {
  throw std::invalid_argument(fmt::format("{} is \"{}\", it must be {}", option, text, words));
}

// The whole text as a number; false if it is none, or beyond the type.
template <class Number>
bool parse_number(const std::string& text, Number& value) {
  const char* const begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  return error == std::errc() && stop == end && !text.starts_with("+-");
}

// The quote that ends the one at `begin`, doubled quotes in between left out; npos if there is none.
std::size_t end_of_quotes(const std::string& text, std::size_t begin) {
  for (std::size_t at = begin + 1; at < text.size(); ++at) {
    if (text[at] != '"') continue;
    if (at + 1 == text.size() || text[at + 1] != '"') return at;
    ++at;
  }
  return std::string::npos;
}

bool is_same_file(const std::string& one, const std::string& other) {
  std::error_code unknown;
  return std::filesystem::equivalent(one, other, unknown) && std::filesystem::is_regular_file(one, unknown);
}

// Where a file lies or will lie: its folder and the links at the end of its path are followed.
std::filesystem::path place_of(const std::string& path) {
  std::error_code unknown;
  std::filesystem::path place = path;
  for (int links = 0; links < most(Limit::symbolic_links) && std::filesystem::is_symlink(place, unknown); ++links) {
    place = place.parent_path() / std::filesystem::read_symlink(place, unknown);
  }
  return std::filesystem::weakly_canonical(std::filesystem::absolute(place, unknown), unknown);
}

// Devices and pipes take what comes, one output after the other.
bool is_device(const std::string& path) {
  std::error_code unknown;
  return std::filesystem::exists(path, unknown) && !std::filesystem::is_regular_file(path, unknown);
}

void refuse_impossible_place(const std::string& path) {
  if (path == "-") {
    throw std::invalid_argument("-: is no name of an output; /dev/stdout is standard output, ./- a file of that name");
  }
  std::error_code unknown;
  const auto fail = [&](const char* reason) {
    throw std::runtime_error(fmt::format("{}: cannot be written: {}", path, reason));
  };
  if (std::filesystem::is_directory(path, unknown)) fail("it is a folder");
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  if (!parent.empty() && !std::filesystem::is_directory(parent, unknown)) fail("its folder does not exist");
}

}  // namespace

double read_number(const std::string& option, const std::string& text, const NumberRange& range) {
  double value = 0.0;
  const bool is_number = parse_number(text, value);
  if (is_number && value >= range.low && value <= range.high) return value;
  constexpr double per_cent = 100.0;
  const bool is_per_cent =
      is_number && range.high <= 1.0 && value > 1.0 && value / per_cent >= range.low && value / per_cent <= range.high;
  refuse(option, text, is_per_cent ? fmt::format("{}; {} % is {}", range.words, text, value / per_cent) : range.words);
}

CLI::Option* add_text(CLI::App& command, const std::string& name, const char* type, const CLI::callback_t& take,
                      const std::string& help, const std::function<std::string()>& show) {
  return command.add_option(name, take, help, false, show)->type_name(type);
}

CLI::Option* add_number(CLI::App& command, const std::string& name, double& value, const NumberRange& range,
                        const std::string& help) {
  const auto take = [name, &value, range](const CLI::results_t& texts) {
    value = read_number(name, texts.back(), range);
    return true;
  };
  return add_text(command, name, "NUMBER", take, help, [&value] { return fmt::format("{}", value); });
}

CLI::Option* add_folds(CLI::App& command, int& folds, const std::string& help) {
  const auto take = [&folds](const CLI::results_t& texts) {
    folds = static_cast<int>(read_count("--folds", texts.back(), 0, std::numeric_limits<int>::max()));
    if (folds == 1) refuse("--folds", texts.back(), "0, or a whole number, 2 or more");
    return true;
  };
  return add_text(command, "--folds", "COUNT", take, help, [&folds] { return std::to_string(folds); })
      ->capture_default_str();
}

CLI::Option* add_numbers(CLI::App& command, const std::string& name, std::vector<double>& values,
                         const NumberRange& range, const std::string& help) {
  const auto take = [name, &values, range](const CLI::results_t& texts) {
    values.clear();
    for (const std::string& text : texts) {
      values.push_back(read_number(name, text, range));
    }
    return true;
  };
  return add_text(command, name, "NUMBER,...", take, help,
                  [&values] { return fmt::format("{}", fmt::join(values, ",")); })
      ->expected(CLI::detail::expected_max_vector_size)
      ->allow_extra_args(false)
      ->delimiter(',');
}

CLI::Option* add_names(CLI::App& command, const std::string& name, std::vector<std::string>& values, const char* type,
                       const std::string& help) {
  const auto take = [&values](const CLI::results_t& texts) {
    values.clear();
    for (const std::string& text : texts) {
      const std::vector<std::string> names = names_in(text);
      values.insert(values.end(), names.begin(), names.end());
    }
    return true;
  };
  return add_text(command, name, type, take, help, {})
      ->type_name(fmt::format("{},...", type))
      ->expected(CLI::detail::expected_max_vector_size)
      ->allow_extra_args(false);
}

std::vector<std::string> names_in(const std::string& text) {
  std::vector<std::string> names(1);
  for (std::size_t at = 0; at < text.size(); ++at) {
    const std::size_t end = names.back().empty() && text[at] == '"' ? end_of_quotes(text, at) : std::string::npos;
    if (end != std::string::npos) {
      names.back() = text.substr(at + 1, end - at - 1);
      for (std::size_t quote = 0; (quote = names.back().find("\"\"", quote)) != std::string::npos; ++quote) {
        names.back().erase(quote, 1);
      }
      at = end;
    } else if (text[at] == ',') {
      names.emplace_back();
    } else {
      names.back() += text[at];
    }
  }
  return names;
}

CLI::Option* add_decimal_comma(CLI::App& command, DecimalMark& mark) {
  const auto take = [&mark] { mark = DecimalMark::comma; };
  return command.add_flag_callback(
      decimal_comma_option, take,
      "Numbers of the table have a decimal comma; fields are separated by semicolons or tabs");
}

CLI::Option* add_thousands(CLI::App& command, bool& thousands) {
  return command.add_flag(thousands_option, thousands,
                          "Numbers of the table may have separators of thousands: 1,234.5");
}

std::int64_t read_count(const std::string& option, const std::string& text, std::int64_t low, std::int64_t high) {
  std::int64_t value = 0;
  if (!parse_number(text, value) || value < low || value > high) {
    constexpr std::int64_t largest = std::numeric_limits<std::int64_t>::max();
    const bool is_large = text.find_first_not_of("+0123456789") == std::string::npos && text.size() > 18;
    refuse(option, text,
           high == largest && !is_large ? fmt::format("a whole number, {} or more", low)
                                        : fmt::format("a whole number from {} to {}", low, high));
  }
  return value;
}

CLI::Option* add_seed(CLI::App& command, std::uint64_t& seed, const std::string& help) {
  const auto take = [&seed](const CLI::results_t& texts) {
    if (!parse_number(texts.back(), seed)) {
      constexpr std::uint64_t largest = std::numeric_limits<std::uint64_t>::max();
      refuse("--seed", texts.back(), fmt::format("a whole number from 0 to {}", largest));
    }
    return true;
  };
  return add_text(command, "--seed", "COUNT", take, help, [&seed] { return std::to_string(seed); })
      ->capture_default_str();
}

CLI::Option* add_threads(CLI::App& command, int& threads) {
  constexpr int most = 4096;
  return add_count(command, "--threads", threads, 0, "0: all; the result does not depend on it", most)
      ->capture_default_str();
}

CLI::Option* add_input_file(CLI::App& command, const std::string& name, std::string& path, const std::string& help) {
  return command.add_option(name, path, help)->type_name(input_type);
}

CLI::Option* add_input_files(CLI::App& command, const std::string& name, std::vector<std::string>& paths,
                             const std::string& help) {
  return command.add_option(name, paths, help)->type_name(input_type)->option_text("FILE ...");
}

CLI::Option* add_output_file(CLI::App& command, const std::string& name, std::string& path, const std::string& help,
                             const std::vector<std::string>& extensions) {
  // The texts of all options are there before the first of them is taken.
  const std::string own_name = name.substr(name.find("--"));
  const auto take = [&command, own_name, &path, extensions](const CLI::results_t& texts) {
    path = texts.back();
    check_output_file(command, own_name, path, extensions);
    return true;
  };
  return add_text(command, name, output_type, take, help, {});
}

void check_output_file(const CLI::App& command, const std::string& name, const std::string& path,
                       const std::vector<std::string>& extensions) {
  std::vector<std::string> written = {path};
  for (const std::string& extension : extensions) {
    written.push_back(beside(path, extension).string());
  }
  const auto is_input = [](const CLI::Option* option) { return option->get_type_name() == input_type; };
  for (const CLI::Option* option : command.get_options(is_input)) {
    for (const std::string& input : option->results()) {
      for (const std::string& output : written) {
        refuse_lost_input(output, input == "-" ? "/dev/stdin" : input);
      }
    }
  }
  for (const std::string& output : written) {
    refuse_impossible_place(output);
  }
  const auto is_output = [&](const CLI::Option* option) {
    return option->get_type_name() == output_type && !option->check_name(name);
  };
  for (const CLI::Option* option : command.get_options(is_output)) {
    for (const std::string& other : option->results()) {
      for (const std::string& output : written) {
        if (is_device(other) || place_of(other) != place_of(output)) continue;
        throw std::invalid_argument(
            fmt::format("{}: would be written twice by this command ({} and --{}); give each output a name of its own",
                        output, name, option->get_single_name()));
      }
    }
  }
}

std::vector<std::string> input_files(const CLI::App& app) {
  std::vector<std::string> files;
  for (const CLI::App* command : app.get_subcommands()) {
    for (const CLI::Option* option : command->get_options()) {
      if (option->get_type_name() == input_type)
        files.insert(files.end(), option->results().begin(), option->results().end());
    }
  }
  return files;
}

void refuse_lost_input(const std::string& output, const std::string& input) {
  if (!is_same_file(output, input)) return;
  throw std::invalid_argument(
      fmt::format("{}: would be overwritten, and is an input of this command ({}); give the output a name of its own",
                  output, input));
}

std::filesystem::path beside(const std::string& path, const std::string& extension) {
  return std::filesystem::path(path).replace_extension(extension);
}

void refuse_exchanged(const std::string& first, const std::string& second, const char* order) {
  throw std::invalid_argument(fmt::format("{} and {} seem to be exchanged: {}", first, second, order));
}

void require_ranges(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    for (const char* type : {"FLOAT", "INT", "UINT"}) {  // what CLI11 calls numbers that it reads itself
      if (option->get_type_name().starts_with(type)) {
        throw std::logic_error(fmt::format("option {} has no range", option->get_name()));
      }
    }
  }
  for (const CLI::App* command : app.get_subcommands({})) {
    require_ranges(*command);
  }
}

}  // namespace llmt::apps
