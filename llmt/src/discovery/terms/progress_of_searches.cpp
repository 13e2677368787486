#include "discovery/terms/progress_of_searches.hpp"

#include <utility>

namespace llmt::discovery {

struct ProgressOfSearches::Shown {
  Progress whole;
  int begin = 0;            // where the present search began
  int of_search = 0;        // what it reported last
  ProgressReport reported;  // to the caller
};

ProgressOfSearches::ProgressOfSearches(Progress whole) {
  if (whole) shown_ = std::make_shared<Shown>(Shown{std::move(whole), 0, 0, {}});
}

Progress ProgressOfSearches::of_each() const {
  if (!shown_) return {};
  return [shown = shown_](const ProgressReport& report) {
    if (report.done < shown->of_search) shown->begin = shown->reported.done;
    shown->of_search = report.done;
    const double half = 0.5 * (report.total - shown->begin);
    shown->reported = report;
    shown->reported.done = shown->begin + static_cast<int>(half * report.done / report.total);
    return shown->whole(shown->reported);
  };
}

void ProgressOfSearches::finish() const {
  if (!shown_) return;
  shown_->reported.done = shown_->reported.total;
  if (!shown_->whole(shown_->reported)) throw Cancelled();
}

}  // namespace llmt::discovery
