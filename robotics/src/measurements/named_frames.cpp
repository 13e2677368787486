#include "measurements/named_frames.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace llmt::robotics {
namespace {

bool has(const std::vector<NamedFrame>& frames, const std::string& name) {
  return std::ranges::find(frames, name, &NamedFrame::name) != frames.end();
}

std::vector<std::string> names_of(const std::string& own, const std::vector<NamedFrame>& frames) {
  std::vector<std::string> names;
  if (!own.empty()) names.push_back(own);
  for (const NamedFrame& frame : frames) {
    if (!is_touched(frame.name)) names.push_back(frame.name);
  }
  return names;
}

}  // namespace

std::string without_dots(std::string name) {
  std::ranges::replace(name, '.', '_');
  return name;
}

std::vector<Observation> known_frames(const Csv& csv, const Chain& chain, const std::vector<std::string>& sessions,
                                      const std::vector<std::string>& targets) {
  const bool knows_sessions = !chain.session.empty() && !sessions.empty();
  const bool knows_targets = !chain.target.empty() && !targets.empty();
  if (!knows_sessions && !knows_targets) return {};
  std::vector<Observation> observations(csv.rows());
  for (Eigen::Index row = 0; row < csv.rows(); ++row) {
    Observation& own = observations[row];
    const auto refuse = [&](const char* column, const std::string& name, const std::vector<std::string>& known) {
      csv.refuse(row, column,
                 fmt::format("the robot was not calibrated with the {} \"{}\"; it knows {}", column, name,
                             fmt::join(known, ", ")));
    };
    if (knows_sessions) {
      const std::string session = without_dots(sessions[row]);
      if (session != chain.session) own.base = session;
      if (!own.base.empty() && (!has(chain.bases, own.base) || is_touched(own.base))) {
        refuse("session", session, names_of(chain.session, chain.bases));
      }
      own.tool = own.base;
    }
    if (knows_targets) {
      const std::string target = without_dots(targets[row]);
      own.tool = own.base.empty() ? target : fmt::format("{}/{}", own.base, target);
      if (own.tool == chain.target) own.tool.clear();
    }
    if (!own.tool.empty() && !has(chain.tools, own.tool)) {
      if (knows_targets) refuse("target", without_dots(targets[row]), names_of(chain.target, chain.tools));
      own.tool.clear();
    }
    own.stand = row;
  }
  const bool is_plain =
      std::ranges::all_of(observations, [](const Observation& own) { return own.base.empty() && own.tool.empty(); });
  return is_plain ? std::vector<Observation>{} : observations;
}

}  // namespace llmt::robotics
