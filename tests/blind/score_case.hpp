/// \file
/// What a tool said about a blind case, judged against the truth.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace blind {

/// A true hidden effect.
struct Truth {
  std::string kind, family;
  bool in_catalogue = true;
  std::vector<std::string> locations;
  double lambda = 0.0;
};

/// An effect that the tool named.
struct Named {
  std::string family, location;
  bool confirmed = false;
  std::set<std::string> rivals;   ///< families that could stand in its place, without exact aliases and generic maps
  std::set<std::string> aliases;  ///< families that are the same thing under another name
};

/// A parameter with a true counterpart.
struct Coverage {
  std::string what;
  bool covered = false;
  double error_in_std_errors = 0.0;
};

struct Judged {
  std::string name, arm, kind, dirty, verdict, first_name;
  double lambda = 0.0, noise_mm = 0.0;
  double lambda_beyond_first_order =
      0.0;  ///< of the softness that the description knows: exact against first-order statics
  int poses = 0;
  bool repeats = false, elastic_description = false;
  std::vector<Truth> hidden;
  std::vector<Named> named;
  bool answered = false;  ///< there is a result of the tool

  int confirmed = 0;
  bool right = false;     ///< every hidden effect has its name among the confirmed ones
  bool by_alias = false;  ///< ... one of them under an exact alias
  bool in_class = false;  ///< every hidden effect is a confirmed name or a rival of one
  bool confidently_wrong =
      false;                 ///< a confirmed name whose class holds no hidden effect, and (one effect hidden) none does
  bool extra = false;        ///< a confirmed name whose class holds no hidden effect
  bool missed = false;       ///< "nothing missing"
  bool false_alarm = false;  ///< nothing hidden, and something else than "nothing missing" was said
  double class_size = 0.0;   ///< mean over the confirmed names: 1 + rival families
  std::string place;         ///< of the right name: "same", "subset", "superset", "other" or ""
  int outliers_true = 0, outliers_found = 0, outliers_wrong = 0;

  // Against positions free of noise, rms over 100 fresh poses, in noise rms.
  std::optional<double> before, after;
  std::optional<double> seconds;
  std::vector<Coverage> coverage;
};

/// Reads DIR/truth/<name>.json and RESULTS/<name>.json; with `gap` also calibrates and evaluates the robots.
Judged judge(const std::string& folder, const std::string& results, const std::string& name, bool gap);

/// Names of the cases in DIR/truth, sorted.
std::vector<std::string> cases(const std::string& folder);

}  // namespace blind
