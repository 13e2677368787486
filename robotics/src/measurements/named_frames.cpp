#include "measurements/named_frames.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <stdexcept>

#include "llmt/robotics/chain.hpp"

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

// Base and tool by the names of a session and a target, empty ones are those of the chain. `refuse` gets "session" or
// "target", a name that is not known, and those that are.
template <typename Refuse>
Observation frames_by_name(const Chain& chain, const std::string& session, const std::string& target,
                           const Refuse& refuse) {
  Observation own;
  if (!session.empty() && session != chain.session) {
    if (!has(chain.bases, session) || is_touched(session)) {
      refuse("session", session, names_of(chain.session, chain.bases));
    }
    own.base = own.tool = session;
  }
  if (!target.empty()) {
    own.tool = own.base.empty() ? target : fmt::format("{}/{}", own.base, target);
    if (own.tool == chain.target) own.tool.clear();
  }
  if (!own.tool.empty() && !has(chain.tools, own.tool)) {
    if (!target.empty()) refuse("target", target, names_of(chain.target, chain.tools));
    own.tool.clear();
  }
  return own;
}

std::string not_known(const char* what, const std::string& name, const std::vector<std::string>& known) {
  return fmt::format("the robot was not calibrated with the {} \"{}\"; it knows {}", what, name,
                     known.empty() ? "none by name" : fmt::format("{}", fmt::join(known, ", ")));
}

}  // namespace

Chain in_session(Chain chain, const std::string& session, const std::string& target) {
  const auto refuse = [](const char* what, const std::string& name, const std::vector<std::string>& known) {
    throw std::invalid_argument("llmt::robotics::in_session: " + not_known(what, name, known));
  };
  const Observation own = frames_by_name(chain, session, target, refuse);
  const auto take = [](std::vector<NamedFrame>& others, const std::string& name, std::string& main, Frame& frame) {
    if (name.empty()) return;
    NamedFrame& other = *std::ranges::find(others, name, &NamedFrame::name);
    frame = other.frame;
    main = name;
  };
  take(chain.bases, own.base, chain.session, chain.base);
  take(chain.tools, own.tool, chain.target, chain.tool);
  chain.bases.clear();
  chain.tools.clear();
  return chain;
}

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
    const auto refuse = [&](const char* column, const std::string& name, const std::vector<std::string>& known) {
      csv.refuse(row, column, not_known(column, name, known));
    };
    const std::string session = knows_sessions ? without_dots(sessions[row]) : "";
    const std::string target = knows_targets ? without_dots(targets[row]) : "";
    if (knows_sessions && session.empty()) refuse("session", "", names_of(chain.session, chain.bases));
    if (knows_targets && target.empty()) refuse("target", "", names_of(chain.target, chain.tools));
    observations[row] = frames_by_name(chain, session, target, refuse);
    observations[row].stand = row;
  }
  const bool is_plain =
      std::ranges::all_of(observations, [](const Observation& own) { return own.base.empty() && own.tool.empty(); });
  return is_plain ? std::vector<Observation>{} : observations;
}

}  // namespace llmt::robotics
