#include "shared/cli.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <sstream>
#include <stdexcept>

#include "llmt/csv.hpp"
#include "llmt/files.hpp"
#include "llmt/limits.hpp"
#include "shared/child_process.hpp"
#include "shared/help.hpp"
#include "shared/manual.hpp"
#include "shared/options.hpp"
#include "shared/standard_error.hpp"

namespace llmt::apps {
namespace {

bool is_silent = false;

// Ends the program as the signal would have, but for temporary files.
extern "C" void end_by_signal(int signal) {
  discard_unfinished_files();
  kill_running_child();
  ::raise(signal);  // comes when the handler has returned, and ends the program: the handler is for once
}

void handle_signals() {
  struct sigaction action = {};
  action.sa_handler = end_by_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before = {};
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) ::sigaction(signal, &action, nullptr);  // nohup stays nohup
  }
  ::signal(SIGXFSZ, SIG_IGN);
}

// "data is required (CSV file with a header row); usage: llmt fit [OPTIONS] data": the first argument that is missing.
std::string missing_argument(const CLI::App& app, const std::string& reason) {
  if (app.get_subcommands().empty()) return reason;
  for (const CLI::Option* option : app.get_subcommands().back()->get_options()) {
    if (!option->get_required() || option->count() > 0) continue;
    return fmt::format("{} is required ({}){}", option->get_name(), option->get_description(), usage_of(app));
  }
  return reason;
}

int parse(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return exit_done;
  } catch (const CLI::RequiredError& error) {
    warn(fmt::format("{}: {}", app.get_name(), missing_argument(app, error.what())));
    return exit_usage;
  } catch (const CLI::ParseError& error) {  // --help and --version come this way too
    if (error.get_exit_code() != 0) {
      const bool is_extra = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
      warn(fmt::format("{}: {}{}", app.get_name(), error.what(),
                       is_extra ? hint_on_extra_argument(app, argc, argv) : std::string()));
      return exit_usage;
    }
    std::ostringstream out;
    std::ostringstream err;
    app.exit(error, out, err);
    print(out.str());
    return exit_done;
  }
}

// Bytes at `i` that a terminal may take for an order, or that change where the text after them stands: control
// characters but tabs and line breaks, marks of direction, line separators of Unicode, bytes that UTF-8 never has.
std::size_t bytes_of_order(std::string_view text, std::size_t i) {
  const auto byte = static_cast<unsigned char>(text[i]);
  if ((byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7F || byte >= 0xF8) return 1;
  const auto follows = [&](std::string_view lead, unsigned char first, unsigned char last) {
    const std::string_view here = text.substr(i);
    if (here.size() <= lead.size() || !here.starts_with(lead)) return false;
    const auto next = static_cast<unsigned char>(here[lead.size()]);
    return next >= first && next <= last;
  };
  if (follows("\xC2", 0x80, 0x9F) || follows("\xD8", 0x9C, 0x9C)) return 2;  // U+0080 ... U+009F, U+061C
  if (follows("\xE2\x80", 0x8E, 0x8F) || follows("\xE2\x80", 0xA8, 0xAE) || follows("\xE2\x81", 0xA6, 0xA9)) return 3;
  return 0;
}

// The middle of a long text left out, not within a character of UTF-8.
std::string shortened(const std::string& text) {
  constexpr std::size_t most = llmt::most(Limit::message_bytes);
  if (text.size() <= most) return text;
  const auto continues = [&](std::size_t i) { return (text[i] & 0xC0) == 0x80; };
  std::size_t first = most / 2;
  std::size_t last = text.size() - most / 2;
  while (first > 0 && continues(first)) --first;
  while (last < text.size() && continues(last)) ++last;
  return fmt::format("{} ... ({} bytes) ... {}", text.substr(0, first), last - first, text.substr(last));
}

void write_stdout(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw std::runtime_error("standard output: cannot be written");
  }
}

}  // namespace

std::string in_words_of_user(std::string_view message, std::span<const SettingName> names) {
  const auto is_part = [](char c) { return c == '_' || c == ':' || std::isalnum(static_cast<unsigned char>(c)) != 0; };
  std::string text(message);
  for (std::size_t at = text.find("llmt::"); at != std::string::npos; at = text.find("llmt::", at + 1)) {
    const std::size_t end = std::find_if_not(text.begin() + at, text.end(), is_part) - text.begin();
    const bool begins = at == 0 || text[at - 1] == ' ';
    if (begins && text[end - 1] == ':' && end < text.size() && text[end] == ' ') text.erase(at, end + 1 - at);
  }
  if (text.size() == message.size()) return text;
  for (const SettingName& name : names) {
    for (std::size_t at = text.find(name.setting); at != std::string::npos; at = text.find(name.setting, at)) {
      const std::size_t end = at + name.setting.size();
      const bool is_whole = (at == 0 || (!is_part(text[at - 1]) && text[at - 1] != '.' && text[at - 1] != '-')) &&
                            (end == text.size() || !is_part(text[end]) || text.compare(end, 2, ": ") == 0);
      if (is_whole) text.replace(at, name.setting.size(), name.option);
      at += is_whole ? name.option.size() : 1;
    }
  }
  return text;
}

int run(CLI::App& app, int argc, char** argv, std::span<const SettingName> names) {
  app.set_version_flag("--version", fmt::format("{} {}", app.get_name(), LLMT_VERSION));
  occupy_closed_standard_files();
  handle_signals();
  set_up_help(app);
  const auto fail = [&](std::string_view reason, int code) {
    warn(fmt::format("{}: {}", app.get_name(), in_words_of_user(reason, names)));
    return code;
  };
  try {
    require_ranges(app);
    const std::string_view only = argc == 2 ? argv[1] : "";
    if (only == "--man" || only == "--bash-completion") {
      write_stdout(only == "--man" ? man_page(app) : bash_completion(app));
      return exit_done;
    }
    refuse_unknown_names(app, argc, argv);
    return parse(app, argc, argv);
  } catch (const ExitCode& end) {
    return end.code;
  } catch (const report::NotEvaluated& error) {
    return fail(error.what(), exit_not_evaluated);
  } catch (const std::invalid_argument& error) {
    const std::string misuse = word_in_place_of_a_file(app, argc, argv);
    return fail(misuse.empty() ? error.what() : misuse, exit_usage);
  } catch (const ThousandsError& error) {
    const auto can = [command = app.get_subcommands().front()](const char* option) {
      return command->get_option_no_throw(option) != nullptr;
    };
    std::vector<std::string> advice;
    if (can(thousands_option)) advice.push_back(fmt::format("{} reads thousands", thousands_option));
    if (!error.is_certain() && can(decimal_comma_option) && error.found() == DecimalMark::comma) {
      advice.push_back(fmt::format("{} reads decimal commas", decimal_comma_option));
    }
    return fail(fmt::format("{}{}{}", error.what(), advice.empty() ? "" : "; ", fmt::join(advice, ", ")), exit_refused);
  } catch (const DecimalMarkError& error) {
    const CLI::App* const command = app.get_subcommands().front();
    const bool can_read = command->get_option_no_throw(decimal_comma_option) != nullptr;
    const char* const advice = error.found() == DecimalMark::comma ? "; {} reads such files" : "; leave {} out";
    return fail(error.what() + (can_read ? fmt::format(fmt::runtime(advice), decimal_comma_option) : ""), exit_refused);
  } catch (const EncodingError& error) {
    return fail(error.what() + std::string("; a file of Windows is converted by iconv -f CP1252 -t UTF-8"),
                exit_refused);
  } catch (const std::bad_alloc&) {
    const std::vector<std::string> files = input_files(app);
    return fail(files.empty() ? "there is not enough memory for this"
                              : fmt::format("{}: there is not enough memory for this", fmt::join(files, ", ")),
                exit_refused);
  } catch (const std::exception& error) {
    const std::string misuse = word_in_place_of_a_file(app, argc, argv);
    return misuse.empty() ? fail(error.what(), exit_refused) : fail(misuse, exit_usage);
  }
}

std::string without_controls(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t bytes = bytes_of_order(text, i);
    for (std::size_t k = 0; k < bytes; ++k) result += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[i + k]));
    if (bytes == 0) result += text[i];
    i += std::max<std::size_t>(bytes, 1);
  }
  return result;
}

Silence::Silence() { is_silent = true; }
Silence::~Silence() { is_silent = false; }

std::size_t output_width() {
  constexpr std::size_t least_width = 40;
  if (::isatty(STDOUT_FILENO) == 0) return report::no_width_limit;
  std::size_t width = 0;
  winsize size = {};
  if (const char* const columns = std::getenv("COLUMNS"); columns != nullptr) {
    const std::string_view text(columns);
    std::from_chars(text.data(), text.data() + text.size(), width);
  } else if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) {
    width = size.ws_col;
  }
  return width == 0 ? report::no_width_limit : std::max(width, least_width);
}

void print(std::string_view text) {
  if (is_silent) return;
  constexpr std::size_t indent = 2;
  write_stdout(report::wrapped(without_controls(text), output_width(), indent));
}

void print_bytes(std::string_view text) {
  if (is_silent) return;
  ::isatty(STDOUT_FILENO) != 0 ? print(text) : write_stdout(text);
}

void print_json(const Json& json) {
  constexpr int indent = 2;
  print_bytes(json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n");
}

void warn(const std::string& text) {
  if (is_silent) return;
  std::string line = without_controls(shortened(text));
  for (std::size_t at = line.find('\n'); at != std::string::npos; at = line.find('\n', at))
    line.replace(at, 1, "\\x0a");
  write_stderr(line + "\n");
}

void warn_of(const Finding& finding) { warn((finding.is_mistake ? "WARNING: " : "") + finding.words({})); }

}  // namespace llmt::apps
