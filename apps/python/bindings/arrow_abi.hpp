/// \file
/// The structures of the Arrow C data interface and the Arrow C stream interface
/// (https://arrow.apache.org/docs/format/CDataInterface.html), and owners that release each of them once.
#pragma once

#include <cstdint>
#include <utility>

namespace llmt::python {

struct ArrowSchema {
  const char* format;
  const char* name;
  const char* metadata;
  std::int64_t flags;
  std::int64_t n_children;
  ArrowSchema** children;
  ArrowSchema* dictionary;
  void (*release)(ArrowSchema*);
  void* private_data;
};

struct ArrowArray {
  std::int64_t length;
  std::int64_t null_count;
  std::int64_t offset;
  std::int64_t n_buffers;
  std::int64_t n_children;
  const void** buffers;
  ArrowArray** children;
  ArrowArray* dictionary;
  void (*release)(ArrowArray*);
  void* private_data;
};

struct ArrowArrayStream {
  int (*get_schema)(ArrowArrayStream*, ArrowSchema* out);
  int (*get_next)(ArrowArrayStream*, ArrowArray* out);
  const char* (*get_last_error)(ArrowArrayStream*);
  void (*release)(ArrowArrayStream*);
  void* private_data;
};

/// One of these structures, released at the end of its life. Empty if there is nothing to release.
template <class Struct>
class Owned {
 public:
  Owned() = default;
  /// Takes the structure away from where the producer put it.
  explicit Owned(Struct* from) : held_(*from) { from->release = nullptr; }
  Owned(Owned&& other) noexcept : held_(std::exchange(other.held_, Struct{})) {}
  Owned& operator=(Owned&& other) noexcept {
    std::swap(held_, other.held_);
    return *this;
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() {
    if (held_.release != nullptr) held_.release(&held_);
  }

  bool empty() const { return held_.release == nullptr; }
  Struct& operator*() { return held_; }
  const Struct& operator*() const { return held_; }
  Struct* operator->() { return &held_; }
  const Struct* operator->() const { return &held_; }
  Struct* get() { return &held_; }

 private:
  Struct held_ = {};
};

}  // namespace llmt::python
