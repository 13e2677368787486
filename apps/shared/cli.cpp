#include "shared/cli.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <new>
#include <sstream>
#include <stdexcept>

#include "llmt/files.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

// Columns on a terminal: bytes of UTF-8 that begin a character.
std::size_t width(const std::string& text) {
  return std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; });
}

bool looks_like_number(const std::string& text) {
  return text.find_first_not_of("0123456789.+-e%") == std::string::npos;
}

// Ends the program as the signal would have, but for temporary files.
extern "C" void end_by_signal(int signal) {
  discard_unfinished_files();
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

int parse(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return exit_done;
  } catch (const CLI::ParseError& error) {  // --help and --version come this way too
    std::ostringstream out;
    std::ostringstream err;
    const int code = app.exit(error, out, err);
    print(out.str());
    if (!err.str().empty()) warn(err.str().substr(0, err.str().find_last_not_of('\n') + 1));
    return code == 0 ? exit_done : exit_usage;
  }
}

// A control character of ASCII, or the second byte of one of U+0080 ... U+009F.
bool is_control(std::string_view text, std::size_t i) {
  const auto byte = static_cast<unsigned char>(text[i]);
  const bool after_c2 = i > 0 && text[i - 1] == '\xC2';
  return (byte < 0x20 && byte != '\n' && byte != '\t') || byte == 0x7F || (after_c2 && byte >= 0x80 && byte < 0xA0);
}

// The middle of a long text left out, not within a character of UTF-8.
std::string shortened(const std::string& text) {
  constexpr std::size_t most = 2000;
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

int run(CLI::App& app, int argc, char** argv) {
  app.set_version_flag("--version", fmt::format("{} {}", app.get_name(), LLMT_VERSION));
  handle_signals();
  const auto fail = [&](const char* reason, int code) {
    warn(fmt::format("{}: {}", app.get_name(), reason));
    return code;
  };
  try {
    require_ranges(app);
    return parse(app, argc, argv);
  } catch (const std::invalid_argument& error) {
    return fail(error.what(), exit_usage);
  } catch (const std::bad_alloc&) {
    return fail("there is not enough memory for this", exit_refused);
  } catch (const std::exception& error) {
    return fail(error.what(), exit_refused);
  }
}

std::string Table::text() const {
  const std::size_t columns = rows_.front().size();
  std::vector<std::size_t> widths(columns, 0);
  std::vector<bool> numeric(columns, rows_.size() > 1);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    for (std::size_t c = 0; c < columns; ++c) {
      widths[c] = std::max(widths[c], width(rows_[r][c]));
      numeric[c] = numeric[c] && (r == 0 || looks_like_number(rows_[r][c]));
    }
  }
  std::string text;
  for (const std::vector<std::string>& row : rows_) {
    std::string line;
    for (std::size_t c = 0; c < columns; ++c) {
      const std::string padding(widths[c] - width(row[c]), ' ');
      line += (c > 0 ? "  " : "") + (numeric[c] ? padding + row[c] : row[c] + padding);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string number(double value, int digits) {
  if (std::isnan(value)) return "-";
  const double magnitude = std::abs(value);
  if (magnitude == 0.0) return "0";
  if (magnitude < 1e-4 || magnitude >= 1e7 || !std::isfinite(value)) {
    return fmt::format("{:.{}g}", value, digits);
  }
  const int before_point = 1 + static_cast<int>(std::floor(std::log10(magnitude)));
  return fmt::format("{:.{}f}", value, std::max(0, digits - before_point));
}

std::string without_controls(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_control(text, i)) {
      result += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[i]));
    } else {
      result += text[i];
    }
  }
  return result;
}

void print(std::string_view text) { write_stdout(without_controls(text)); }

void print_bytes(std::string_view text) { ::isatty(STDOUT_FILENO) != 0 ? print(text) : write_stdout(text); }

void print_json(const Json& json) {
  constexpr int indent = 2;
  print_bytes(json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n");
}

void warn(const std::string& text) { fmt::print(stderr, "{}\n", without_controls(shortened(text))); }

void Progress::show(Eigen::Index done, Eigen::Index total) {
  if (::isatty(STDERR_FILENO) == 0) return;
  constexpr Eigen::Index bar = 30;
  const Eigen::Index filled = total > 0 ? bar * done / total : bar;
  fmt::print(stderr, "\r{} [{}{}] {}/{}", what_, std::string(filled, '#'), std::string(bar - filled, '.'), done, total);
  std::fflush(stderr);
  shown_ = true;
}

void Progress::clear() {
  if (shown_) {
    fmt::print(stderr, "\r\033[K");
    shown_ = false;
  }
}

}  // namespace llmt::apps
