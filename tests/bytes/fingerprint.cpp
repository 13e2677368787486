// Prints what the bytes of results depend on besides compiler and libraries: the C library, whose exp, sin and pow
// differ in the last bit between versions, and whether the processor has the fused multiply-add that they then use.
#include <gnu/libc-version.h>

#include <cstdio>

int main() {
#if defined(__x86_64__)
  const bool fused = __builtin_cpu_supports("fma") && __builtin_cpu_supports("avx2");
#else
  const bool fused = true;
#endif
  std::printf("glibc %s %s fma", gnu_get_libc_version(), fused ? "with" : "without");
}
