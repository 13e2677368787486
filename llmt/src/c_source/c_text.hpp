/// \file
/// Text of C: tables, names, comments.
#pragma once

#include <string>
#include <vector>

#include "llmt/c_code.hpp"
#include "llmt/partition.hpp"

namespace llmt {

/// Tables of C, number by number in a form that reads back exactly.
class Tables {
 public:
  /// `name` begins the names of all tables.
  explicit Tables(std::string name) : name_(std::move(name)) {}

  static std::string number(double value);

  /// Adds a table, if it is not empty, and returns its name; "0" if it is.
  std::string add(const std::string& what, const char* type, const std::vector<std::string>& entries);
  std::string add(const std::string& what, const std::vector<double>& values);
  std::string add(const std::string& what, const std::vector<int>& values);

  const std::string& text() const { return text_; }

 private:
  std::string name_;
  std::string text_;
};

/// The text with the name in place of every '@'.
std::string with_name(std::string text, const std::string& name);

/// Text that stands in a comment: no end of it, no line breaks, no marks of direction, with which a comment may look
/// like code and of which compilers warn.
std::string c_comment(const std::string& text);

/// The comment at the head of a source and its header: what the model is, its inputs and outputs.
std::string head_comment(const std::string& kind, const std::vector<InputColumn>& inputs,
                         const std::vector<OutputColumn>& outputs, const std::string& name);

/// The header, and the source from `code`, in which '@' stands for the name, and the tables before `functions`.
CSource c_source_of(const std::string& comment, const std::string& name, const std::string& header_name,
                    const std::string& declarations, const Tables& tables, const std::string& functions);

/// Throws std::invalid_argument if the name is no identifier of C.
void check_c_name(const std::string& name);

}  // namespace llmt
