/// \file
/// What should be known of a table or of a result, as a value. Its words are made for the interface that says them: the
/// programs name options and lines of files, Python names arguments and rows of tables in memory.
///
///     const std::vector<Eigen::Index> lines = {5, 7};
///     const auto sentence = [=](const llmt::Face& face) { return face.rows(lines) + " are 0"; };
///     const llmt::Finding zeros = {"zeros", sentence, lines};
///     const std::string text = zeros.words({});  // "lines 5, 7 are 0"
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "llmt/abi.hpp"

namespace llmt {

/// How an interface calls what its user gave: by default as the programs do. Python has
/// `{.before_option = "", .between_words = '_', .switched_on = "=True"}`.
struct Face {
  std::string before_option = "--";
  char between_words = '-';
  std::string switched_on = {};
  bool in_memory = false;  ///< tables have the names of their arguments, <name>; line 2 of their text is row 0

  /// "--same-session", same_session.
  std::string option(std::string_view name) const;
  /// An option that is on: "--robust", robust=True.
  std::string switched(std::string_view name) const { return option(name) + switched_on; }
  /// "line 7", "lines 5, 7", or of a table in memory "rows 3, 5"; beyond `most` of them "...".
  std::string rows(const std::vector<Eigen::Index>& lines,
                   std::size_t most = std::numeric_limits<std::size_t>::max()) const;
  /// The name of a table without brackets.
  std::string table(const std::string& name) const;
  /// "table.csv:7", or of a table in memory "table, row 5".
  std::string place(const std::string& table, Eigen::Index line) const;
};

/// "line 7", "lines 5, 7", or beyond `most` of them "lines 5, 7, ...".
std::string numbered(std::string_view noun, const std::vector<Eigen::Index>& numbers,
                     std::size_t most = std::numeric_limits<std::size_t>::max());

struct Finding {
  std::string code;                               ///< what was found; stays the same when the words change
  std::function<std::string(const Face&)> words;  ///< a sentence
  std::vector<Eigen::Index> lines = {};           ///< of the table's file that it is about; its header is line 1
  bool is_mistake = false;                        ///< results are probably wrong
};

/// A finding whose words are the same for all.
Finding finding(std::string code, std::string sentence);

/// The sentences.
std::vector<std::string> words(const std::vector<Finding>& findings, const Face& face);

}  // namespace llmt
