/// \file
/// What a piece of work costs: wall and CPU seconds, peak memory.
#pragma once

#include <sys/resource.h>

#include <chrono>
#include <fstream>
#include <string>

namespace bench {

/// User and system time of this process, all threads.
inline double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Largest memory that this program has held, in bytes. Read from /proc where it exists, because ru_maxrss starts at
/// the peak of the program that started this one.
inline double peak_memory() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return 1024.0 * std::stod(line.substr(6));
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * static_cast<double>(usage.ru_maxrss);
}

struct Cost {
  double wall = 0.0;    ///< s
  double cpu = 0.0;     ///< s, all threads
  double memory = 0.0;  ///< bytes by which the peak grew
};

template <class Work>
Cost measure(const Work& work) {
  const double memory = peak_memory();
  const double cpu = cpu_seconds();
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  return {wall.count(), cpu_seconds() - cpu, peak_memory() - memory};
}

}  // namespace bench
