/// \file
/// New content for a file, which takes the place of the old one as a whole or not at all.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "base/descriptor.hpp"

namespace llmt {

/// Writes all of `text`. False if it cannot; the reason is in errno.
bool write_all(const Descriptor& file, std::string_view text);

/// A name that nobody can foresee, for a file that another name awaits. What stands at it is removed at the end.
class TemporaryName {
 public:
  explicit TemporaryName(const std::filesystem::path& folder);
  ~TemporaryName();
  TemporaryName(const TemporaryName&) = delete;
  TemporaryName& operator=(const TemporaryName&) = delete;

  const char* path() const { return path_.c_str(); }
  /// From now on remove_announced() removes the file at this name. To be called before a file is made.
  void announce();
  /// See discard_unfinished_files().
  static void remove_announced() noexcept;
  void set_made(bool made) { is_made_ = made; }
  bool is_made() const { return is_made_; }

 private:
  std::filesystem::path path_;
  int place_ = -1;  // in the list of announced names
  bool is_made_ = false;
};

/// A file in `folder`, open for reading and writing, that only this process can reach: it has no name, or where the
/// file system has no such files only while it is made. Not open if it cannot be made; the reason is in errno.
Descriptor temporary_file(const std::filesystem::path& folder);

/// Content on its way. Until replace_target() nothing has changed at the target, and without it nothing is left. The
/// steps after the last write are three, so that several files can take each of them together.
class StagedFile {
 public:
  /// In the folder of `target`. Errors, here and below, are std::runtime_error and call the file `name`.
  StagedFile(std::string name, std::filesystem::path target);
  void write(std::string_view text);
  /// Sees that all is on the disk and that nothing is left to do but a rename.
  void finish();
  void replace_target();
  /// Sees that the new name is on the disk.
  void make_durable() const;

 private:
  void open(mode_t mode);
  void give_name();
  void check(bool done);
  [[noreturn]] void fail(const char* reason) const;

  std::string name_;
  std::filesystem::path target_;
  std::filesystem::path folder_;
  TemporaryName temporary_;
  Descriptor file_;
  bool has_failed_ = false;  // a caller that catches the error of a write cannot put half a file in place
};

}  // namespace llmt
