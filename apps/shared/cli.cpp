#include "shared/cli.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace llmt::apps {
namespace {

// Columns on a terminal: bytes of UTF-8 that begin a character.
std::size_t width(const std::string& text) {
  return std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; });
}

bool looks_like_number(const std::string& text) {
  return text.find_first_not_of("0123456789.+-e%") == std::string::npos;
}

}  // namespace

int run(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return exit_done;
  } catch (const CLI::Success& success) {  // --help, --version
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    app.exit(error);
    return exit_usage;
  } catch (const std::invalid_argument& error) {
    warn(fmt::format("{}: {}", app.get_name(), error.what()));
    return exit_usage;
  } catch (const std::exception& error) {
    warn(fmt::format("{}: {}", app.get_name(), error.what()));
    return exit_refused;
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

void print(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw std::runtime_error("standard output: cannot be written");
  }
}

void print_json(const Json& json) { print(json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"); }

void warn(const std::string& text) { fmt::print(stderr, "{}\n", text); }

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
