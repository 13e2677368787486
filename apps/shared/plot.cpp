#include "shared/plot.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <stdexcept>

#include "llmt/files.hpp"

namespace llmt::apps {
namespace {

using report::Axis;
using report::Chart;
using report::Layer;
using report::Mark;
using report::Numbers;
using report::Reference;

constexpr const char* program = "gnuplot";

const std::string& colour(const std::string& role) {
  static const std::map<std::string, std::string> colours = {
      {"data", "#7d8b99"},  {"model", "#1763b6"}, {"before", "#d9822b"}, {"after", "#1763b6"}, {"muted", "#b4bec8"},
      {"floor", "#2d8a4e"}, {"bad", "#c5352f"},   {"up", "#1763b6"},     {"down", "#d9822b"}};
  return colours.at(role);
}

// A text of gnuplot. What has a meaning within its double quotes, substitution by backquotes among it, is written as
// the number of the byte; within single quotes gnuplot 5.4 takes some doubled quotes for the end.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < ' ') continue;
    if (std::string_view("\"'\\`@$").find(c) == std::string_view::npos) {
      result += c;
    } else {
      result += fmt::format("\\{:03o}", static_cast<unsigned char>(c));
    }
  }
  return result + "\"";
}

// gnuplot leaves the end of a CDATA section in texts as it is, which XML forbids. Its pictures have no such section.
std::string as_xml(std::string picture) {
  constexpr std::string_view end = "]]>";
  for (std::size_t at = picture.find(end); at != std::string::npos; at = picture.find(end, at)) {
    picture.replace(at, end.size(), "]]&gt;");
  }
  return picture;
}

std::string value_text(double value) { return std::isfinite(value) ? fmt::format("{:.7g}", value) : "NaN"; }

double at(const Numbers& values, std::size_t k, double otherwise) { return values.empty() ? otherwise : values[k]; }

// The start of bars that would begin at 0: on a logarithmic axis a little below the shortest.
double start_of_bars(const Chart& chart) {
  if (!chart.y.log) return -std::numeric_limits<double>::infinity();
  double least = std::numeric_limits<double>::infinity();
  for (const Layer& layer : chart.layers) {
    for (const double y : layer.y) {
      if (y > 0.0) least = std::min(least, y);
    }
  }
  return 0.5 * least;
}

// A data block: x, y, low, high, base, colour.
std::string data_block(const Layer& layer, std::size_t number, double start) {
  std::string text = fmt::format("$d{} << EOD\n", number);
  for (std::size_t k = 0; k < layer.x.size(); ++k) {
    const double y = at(layer.y, k, 0.0);
    const std::string& role = layer.roles.empty() ? layer.role : layer.roles[k];
    const double base = at(layer.base, k, 0.0);
    text += fmt::format("{} {} {} {} {} {}\n", value_text(layer.x[k]), value_text(base + y),
                        value_text(at(layer.low, k, y)), value_text(at(layer.high, k, y)),
                        value_text(std::max(base, start)), std::stoi(colour(role).substr(1), nullptr, 16));
  }
  return text + "EOD\n";
}

struct BarPlace {
  double width = 0.8;
  double shift = 0.0;
};

// Bars of several layers stand side by side unless they are histograms over each other.
BarPlace bar_place(const Chart& chart, std::size_t number) {
  std::vector<std::size_t> bars;
  for (std::size_t k = 0; k < chart.layers.size(); ++k) {
    if (chart.layers[k].mark == Mark::bars) bars.push_back(k);
  }
  double spacing = 1.0;
  const Numbers& x = chart.layers[number].x;
  if (x.size() > 1) spacing = std::abs(x[1] - x[0]);
  if (chart.overlay) return {0.95 * spacing, 0.0};
  const double width = 0.75 * spacing / static_cast<double>(bars.size());
  const auto place = std::find(bars.begin(), bars.end(), number) - bars.begin();
  return {width, (static_cast<double>(place) - 0.5 * static_cast<double>(bars.size() - 1)) * width};
}

std::string plot_element(const Chart& chart, std::size_t number) {
  const Layer& layer = chart.layers[number];
  const std::string name = layer.name.empty() ? "notitle" : "title " + quoted(layer.name);
  const std::string shade = "lc rgb " + quoted(colour(layer.role));
  switch (layer.mark) {
    case Mark::points:
      return fmt::format("$d{} using 1:2 with points pt 7 ps {} {} {}", number, layer.x.size() > 600 ? 0.35 : 0.7,
                         shade, name);
    case Mark::line:
      return fmt::format("$d{} using 1:2 with {} lw 2 dt {} {} {}", number, layer.steps ? "steps" : "lines",
                         layer.dashed ? 2 : 1, shade, name);
    case Mark::band:
      return fmt::format("$d{} using 1:3:4 with filledcurves fs transparent solid 0.18 noborder {} {}", number, shade,
                         name);
    case Mark::bars:
      break;
  }
  const BarPlace place = bar_place(chart, number);
  const std::string box =
      layer.horizontal ? fmt::format("5:($1+{0}):5:2:($1+{0}-{1}):($1+{0}+{1}):6", place.shift, 0.5 * place.width)
                       : fmt::format("($1+{0}):5:($1+{0}-{1}):($1+{0}+{1}):5:2:6", place.shift, 0.5 * place.width);
  std::string text = fmt::format("$d{} using {} with boxxyerror fs transparent solid 0.8 noborder lc rgb variable {}",
                                 number, box, "notitle");
  if (!layer.name.empty()) text += fmt::format(", \\\n  NaN with boxes fs solid 0.8 noborder {} {}", shade, name);
  if (!layer.low.empty()) {
    text += fmt::format(
        ", \\\n  $d{} using {} with {} lc rgb '#5b6875' notitle", number,
        layer.horizontal ? fmt::format("2:($1+{}):3:4", place.shift) : fmt::format("($1+{}):2:3:4", place.shift),
        layer.horizontal ? "xerrorbars pt 0" : "yerrorbars pt 0");
  }
  return text;
}

// The labels at the ends of horizontal bars, and room for them.
std::string bar_labels(const Chart& chart) {
  std::string text;
  double high = 0.0;
  for (const Layer& layer : chart.layers) {
    if (!layer.horizontal || layer.labels.empty()) continue;
    for (std::size_t k = 0; k < layer.labels.size(); ++k) {
      const double end = at(layer.base, k, 0.0) + layer.y[k];
      high = std::max(high, end);
      text += fmt::format("set label {} at first {}, first {} offset 0.7,0\n", quoted(layer.labels[k]), value_text(end),
                          value_text(layer.x[k]));
    }
  }
  return high > 0.0 ? text + fmt::format("set xrange [*:{}]\n", value_text(1.25 * high)) : text;
}

std::string axis_lines(const Axis& axis, const char* which) {
  std::string text = fmt::format("set {}label {}\n", which, quoted(axis.title));
  if (axis.log) text += fmt::format("set logscale {}\n", which);
  if (axis.range) {
    text += fmt::format("set {}range [{}:{}]\n", which, value_text(axis.range->first), value_text(axis.range->second));
  }
  if (axis.categories.empty()) return text;
  std::string places;
  for (std::size_t k = 0; k < axis.categories.size(); ++k) {
    places += fmt::format("{}{} {}", k == 0 ? "" : ", ", quoted(axis.categories[k]), k);
  }
  const double last = static_cast<double>(axis.categories.size()) - 0.4;
  const bool down = *which == 'y';  // names are read from top to bottom
  return text + fmt::format("set {0}tics ({1})\nset {0}range [{2}:{3}]\n", which, places, down ? last : -0.6,
                            down ? -0.6 : last);
}

// A file without a name, gone at the end.
class UnnamedFile {
 public:
  explicit UnnamedFile(const std::string& text) : file_(std::tmpfile()) {
    if (file_ == nullptr || std::fwrite(text.data(), 1, text.size(), file_) != text.size() || std::fflush(file_) != 0) {
      throw std::runtime_error("--plot: no room for a temporary file");
    }
    std::rewind(file_);
  }
  UnnamedFile(const UnnamedFile&) = delete;
  UnnamedFile& operator=(const UnnamedFile&) = delete;
  ~UnnamedFile() {
    if (file_ != nullptr) std::fclose(file_);
  }

  int descriptor() const { return ::fileno(file_); }
  std::string content() const {
    std::rewind(file_);
    std::string text;
    std::array<char, 65536> piece;
    while (const std::size_t count = std::fread(piece.data(), 1, piece.size(), file_)) text.append(piece.data(), count);
    return text;
  }

 private:
  std::FILE* file_;
};

// Runs gnuplot on a script; what it writes to its standard output.
std::string run_gnuplot(const std::string& script) {
  const UnnamedFile in(script);
  const UnnamedFile out("");
  const UnnamedFile errors("");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.descriptor(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.descriptor(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, errors.descriptor(), STDERR_FILENO);
  std::string name = program;
  std::string no_settings = "-d";  // of the user
  char* const arguments[] = {name.data(), no_settings.data(), nullptr};
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child, program, &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw std::runtime_error("--plot: gnuplot cannot be started");
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  std::string picture = out.content();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || picture.empty()) {
    throw std::runtime_error("--plot: gnuplot refused: " + errors.content().substr(0, 500));
  }
  return picture;
}

}  // namespace

std::string gnuplot_script(const Chart& chart, const std::string& format) {
  std::string text =
      format == "svg" ? "set terminal svg size 800,520 dynamic background '#ffffff' font 'DejaVu Sans,14' noenhanced\n"
                      : "set terminal pngcairo size 1600,1040 background '#ffffff' font 'DejaVu Sans,14' fontscale 1.9 "
                        "linewidth 2 pointscale 2 noenhanced\n";
  text += "set title " + quoted(chart.title) + " offset 0,0.3\n";
  text += axis_lines(chart.x, "x") + axis_lines(chart.y, "y");
  text += "set border 3 lc rgb '#5b6875'\nset tics nomirror textcolor rgb '#333333'\nset grid lc rgb '#e1e5ea' lt 1\n";
  text += "set key tmargin center horizontal Left reverse samplen 2 width -2\n";
  text += "set style fill solid\nset errorbars small\n";
  if (chart.equal) text += "set size ratio -1\n";
  const double start = start_of_bars(chart);
  for (std::size_t k = 0; k < chart.layers.size(); ++k) text += data_block(chart.layers[k], k, start);
  for (const Reference& line : chart.references) {
    text += fmt::format("set arrow from {} to {} nohead dt 3 lw 2 lc rgb {} front\n",
                        line.vertical ? fmt::format("first {}, graph 0", value_text(line.value))
                                      : fmt::format("graph 0, first {}", value_text(line.value)),
                        line.vertical ? fmt::format("first {}, graph 1", value_text(line.value))
                                      : fmt::format("graph 1, first {}", value_text(line.value)),
                        quoted(colour(line.role)));
    text += fmt::format("set label {} at {} {} textcolor rgb {} front offset 0,0.5\n", quoted(line.name),
                        line.vertical ? fmt::format("first {}, graph 1", value_text(line.value))
                                      : fmt::format("graph 1, first {}", value_text(line.value)),
                        line.vertical ? "left" : "right", quoted(colour(line.role)));
  }
  text += bar_labels(chart);
  text += "plot ";
  for (std::size_t k = 0; k < chart.layers.size(); ++k) {
    text += (k == 0 ? "" : ", \\\n  ") + plot_element(chart, k);
  }
  return text + "\n";
}

std::string plot_format(const std::string& path) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension == ".svg" || extension == ".png") return extension.substr(1);
  throw std::invalid_argument(fmt::format("--plot {}: the name must end in .svg or .png", path));
}

void require_gnuplot() {
  const char* const path = std::getenv("PATH");
  const std::string folders = path == nullptr ? "/usr/bin:/bin" : path;
  for (std::size_t begin = 0; begin <= folders.size();) {
    const std::size_t end = std::min(folders.find(':', begin), folders.size());
    const std::string file = folders.substr(begin, end - begin) + "/" + program;
    if (::access(file.c_str(), X_OK) == 0) return;
    begin = end + 1;
  }
  throw std::runtime_error("--plot: there is no gnuplot on this machine (Debian package gnuplot-nox)");
}

void write_plot(const std::string& path, const Chart& chart) {
  const std::string format = plot_format(path);
  std::string picture = run_gnuplot(gnuplot_script(chart, format));
  write_file(path, format == "svg" ? as_xml(std::move(picture)) : picture);
}

}  // namespace llmt::apps
