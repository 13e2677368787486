#include "report/document/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

namespace llmt::report {

std::vector<Eigen::Index> thinned(Eigen::Index count, Eigen::Index most) {
  const Eigen::Index shown = std::min(count, most);
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < shown; ++k) rows.push_back(k * count / shown);
  return rows;
}

std::string thinning_note(Eigen::Index count, const std::string& what, Eigen::Index most) {
  if (count <= most) return "";
  return fmt::format(" {} of {} {} are drawn; all figures are of all of them.", most, count, what);
}

double quantile(Numbers values, double share) {
  if (values.empty()) return std::nan("");
  std::ranges::sort(values);
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

Numbers steps_between(double low, double high, int count) {
  Numbers values;
  for (int k = 0; k < count; ++k) values.push_back(low + (high - low) * k / (count - 1));
  return values;
}

std::string file_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }

Chart histogram(const std::string& title, const std::string& axis, const std::vector<Sample>& samples) {
  const Numbers& first = samples.front().values;
  const int bins = std::clamp(2 * static_cast<int>(std::sqrt(static_cast<double>(first.size()))), 8, 40);
  const bool is_signed = quantile(first, 0.0) < 0.0;
  const double low = is_signed ? quantile(first, 0.005) : 0.0;
  double high = quantile(first, 0.995);
  if (!(high > low)) high = low + 1.0;
  const double width = (high - low) / bins;
  Chart chart{.title = title, .x = {axis}, .y = {"share of the values, %"}, .layers = {}, .overlay = true};
  std::size_t beyond = 0;
  std::size_t all = 0;
  for (const Sample& sample : samples) {
    Layer layer{.mark = Mark::bars, .name = sample.name, .role = sample.role};
    Numbers counts(bins, 0.0);
    for (const double value : sample.values) {
      const double place = std::floor((value - low) / width);
      if (place >= 0.0 && place < bins) {
        counts[static_cast<std::size_t>(place)] += 1.0;
      } else {
        ++beyond;
      }
    }
    all += sample.values.size();
    for (int k = 0; k < bins; ++k) {
      layer.x.push_back(low + (k + 0.5) * width);
      layer.y.push_back(100.0 * counts[k] / static_cast<double>(std::max<std::size_t>(1, sample.values.size())));
    }
    chart.layers.push_back(std::move(layer));
  }
  if (beyond > 0) chart.caption = fmt::format("{} of {} values lie beyond the axis.", beyond, all);
  return chart;
}

Chart shares_below(const std::string& title, const std::string& axis, const std::vector<Sample>& samples) {
  constexpr int places = 200;
  Chart chart{.title = title, .x = {axis, true}, .y = {"share of the poses below, %"}, .layers = {}};
  for (const Sample& sample : samples) {
    Layer layer{.mark = Mark::line, .name = sample.name, .role = sample.role};
    Numbers sorted = sample.values;
    std::ranges::sort(sorted);
    const auto count = static_cast<Eigen::Index>(sorted.size());
    for (const Eigen::Index k : thinned(count, places)) {
      if (sorted[k] <= 0.0) continue;
      layer.x.push_back(sorted[k]);
      layer.y.push_back(100.0 * static_cast<double>(k + 1) / static_cast<double>(count));
    }
    if (count > 0 && sorted.back() > 0.0) {
      layer.x.push_back(sorted.back());
      layer.y.push_back(100.0);
    }
    chart.layers.push_back(std::move(layer));
  }
  return chart;
}

Chart ranking(const std::string& title, const std::string& axis, const std::vector<std::string>& names,
              const Numbers& values, const std::vector<std::string>& labels, const std::string& role) {
  Layer bars{.mark = Mark::bars, .role = role, .y = values, .labels = labels, .horizontal = true};
  for (std::size_t k = 0; k < names.size(); ++k) bars.x.push_back(static_cast<double>(k));
  return {.title = title, .x = {axis}, .y = {"", false, names}, .layers = {bars}};
}

}  // namespace llmt::report
