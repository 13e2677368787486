// Prints what the bytes of results depend on besides compiler and libraries: the C library, whose exp, sin and pow
// differ in the last bit between versions, whether the processor has the fused multiply-add that they then use, and its
// caches, by whose sizes Eigen cuts products of large matrices into sums.
#include <gnu/libc-version.h>

#include <Eigen/Core>
#include <cstdio>

int main() {
#if defined(__x86_64__)
  const bool fused = __builtin_cpu_supports("fma") && __builtin_cpu_supports("avx2");
#else
  const bool fused = true;
#endif
  std::printf("glibc %s %s fma, caches of %td, %td and %td KiB", gnu_get_libc_version(), fused ? "with" : "without",
              Eigen::l1CacheSize() / 1024, Eigen::l2CacheSize() / 1024, Eigen::l3CacheSize() / 1024);
}
