/// \file
/// Findings: facts that a user should know of a table or of a result, as values. The sentence of a finding is made for
/// the interface that says it. The programs name options and lines of files, Python names arguments and rows of tables
/// in memory.
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

/// The names that an interface has for options, tables and rows. The defaults are those of the programs. Python has
/// `{.before_option = "", .between_words = '_', .switched_on = "=True"}`.
struct Face {
  std::string before_option = "--";  ///< stands before the name of an option
  char between_words = '-';          ///< stands between the words of its name
  std::string switched_on = {};      ///< stands behind an option that is on
  bool in_memory = false;  ///< tables have the names of their arguments, <name>; line 2 of their text is row 0

  /// The name of an option: "--same-session", or same_session in Python.
  std::string option(std::string_view name) const;
  /// An option that is on: "--robust", or robust=True in Python.
  std::string switched(std::string_view name) const { return option(name) + switched_on; }
  /// The rows at some lines: "line 7", "lines 5, 7", or of a table in memory "rows 3, 5". Beyond `most` of them "...".
  std::string rows(const std::vector<Eigen::Index>& lines,
                   std::size_t most = std::numeric_limits<std::size_t>::max()) const;
  /// The name of a table without brackets.
  std::string table(const std::string& name) const;
  /// A line of a table: "table.csv:7", or of a table in memory "table, row 5".
  std::string place(const std::string& table, Eigen::Index line) const;
};

/// A noun with its numbers: "line 7", "lines 5, 7", or beyond `most` of them "lines 5, 7, ...".
std::string numbered(std::string_view noun, const std::vector<Eigen::Index>& numbers,
                     std::size_t most = std::numeric_limits<std::size_t>::max());

/// One fact that a user should know.
struct Finding {
  std::string code;                               ///< name of the fact; stays the same when the words change
  std::function<std::string(const Face&)> words;  ///< makes its sentence
  std::vector<Eigen::Index> lines = {};           ///< lines of the table that it is about; the header is line 1
  bool is_mistake = false;                        ///< results are probably wrong
};

/// A finding whose sentence is the same for all interfaces.
Finding finding(std::string code, std::string sentence);

/// The sentences of findings, in their order.
std::vector<std::string> words(const std::vector<Finding>& findings, const Face& face);

}  // namespace llmt
