/// \file
/// States of fits beyond memory as files: a header of 32 bytes with format, version, kind, the length of the content
/// and its checksum, then the content.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace state_files {

inline constexpr std::size_t header_bytes = 32;

inline std::uint64_t number(const std::string& file, std::size_t at) {
  std::uint64_t value = 0;
  std::memcpy(&value, file.data() + at, sizeof value);
  return value;
}

/// FNV-1a of words of eight bytes, and the last step of splitmix64.
inline std::uint64_t checksum(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL + bytes.size();
  for (std::size_t at = 0; at < bytes.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
    hash = (hash ^ word) * 0x100000001b3ULL;
    hash ^= hash >> 29;
  }
  hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9ULL;
  return hash ^ (hash >> 31);
}

inline std::string content(const std::string& file) { return file.substr(header_bytes); }

/// A file with other content, whose header goes with it.
inline std::string sealed_as(const std::string& file, const std::string& content) {
  std::string header = file.substr(0, header_bytes);
  const std::uint64_t length = content.size();
  const std::uint64_t sum = checksum(content);
  std::memcpy(header.data() + 16, &length, sizeof length);
  std::memcpy(header.data() + 24, &sum, sizeof sum);
  return header + content;
}

/// The files that stand one behind the other at the beginning of a text.
inline std::vector<std::string> split(std::string_view text) {
  std::vector<std::string> files;
  while (text.starts_with("LLMTSUMS") && text.size() > header_bytes) {
    const std::size_t length = header_bytes + number(std::string(text.substr(0, header_bytes)), 16);
    if (length > text.size()) break;
    files.emplace_back(text.substr(0, length));
    text.remove_prefix(length);
  }
  return files;
}

}  // namespace state_files
