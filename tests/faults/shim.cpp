// To be preloaded into a program: of the system calls that change files in one folder, the one that is asked for fails.
//   LLMT_FAULT_FOLDER    calls on files in this folder count, and no others
//   LLMT_FAULT_CALL      which of them: 1 is the first
//   LLMT_FAULT_KIND      what happens there: "fail", or the number of a signal that comes before the call
//   LLMT_FAULT_NAMELESS  "no": the file system has no files without a name; that is no fault and does not count
//   LLMT_FAULT_FIRED     a file that is made, in another folder, when the call has been reached
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

namespace {

std::string setting(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

bool is_in_folder(const std::string& name) {
  const std::string path = std::filesystem::absolute(name).string();
  const std::string folder = setting("LLMT_FAULT_FOLDER");
  return !folder.empty() && (path == folder || path.starts_with(folder + "/"));
}

bool is_in_folder(int file) {
  char path[PATH_MAX];
  const ssize_t length = ::readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path, sizeof path);
  return length > 0 && is_in_folder(std::string(path, static_cast<std::size_t>(length)));
}

// Whether this call is the one that fails; `error` is what errno then says.
bool fails(int error) {
  static int calls = 0;
  if (++calls != std::atoi(setting("LLMT_FAULT_CALL").c_str())) return false;
  const std::string fired = setting("LLMT_FAULT_FIRED");
  ::syscall(SYS_close, ::syscall(SYS_openat, AT_FDCWD, fired.c_str(), O_CREAT | O_WRONLY, 0600));
  const std::string kind = setting("LLMT_FAULT_KIND");
  if (kind != "fail") {
    ::raise(std::atoi(kind.c_str()));
    return false;
  }
  errno = error;
  return true;
}

template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

int open_as(const char* name, const char* path, int flags, mode_t mode) {
  if ((flags & O_TMPFILE) == O_TMPFILE && setting("LLMT_FAULT_NAMELESS") == "no") {
    errno = EOPNOTSUPP;
    return -1;
  }
  if (is_in_folder(path) && fails(ENOSPC)) return -1;
  return next<int(const char*, int, ...)>(name)(path, flags, mode);
}

mode_t mode_of(int flags, va_list arguments) {
  const bool makes = (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE;
  return makes ? va_arg(arguments, mode_t) : 0;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_of(flags, arguments);
  va_end(arguments);
  return open_as("open", path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_of(flags, arguments);
  va_end(arguments);
  return open_as("open64", path, flags, mode);
}

ssize_t write(int file, const void* text, size_t size) {
  if (is_in_folder(file) && fails(ENOSPC)) return -1;
  return next<ssize_t(int, const void*, size_t)>("write")(file, text, size);
}

int fsync(int file) {
  if (is_in_folder(file) && fails(EIO)) return -1;
  return next<int(int)>("fsync")(file);
}

int fchmod(int file, mode_t mode) {
  if (is_in_folder(file) && fails(EPERM)) return -1;
  return next<int(int, mode_t)>("fchmod")(file, mode);
}

int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
  if (is_in_folder(to) && fails(EDQUOT)) return -1;
  return next<int(int, const char*, int, const char*, int)>("linkat")(from_folder, from, to_folder, to, flags);
}

int rename(const char* from, const char* to) {
  if (is_in_folder(to) && fails(EACCES)) return -1;
  return next<int(const char*, const char*)>("rename")(from, to);
}

// A failing close() closes all the same.
int close(int file) {
  const bool fault = is_in_folder(file) && fails(EIO);
  const int error = errno;
  const int result = next<int(int)>("close")(file);
  if (!fault) return result;
  errno = error;
  return -1;
}
}
