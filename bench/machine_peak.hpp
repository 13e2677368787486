/// \file
/// What this machine can do at most, for figures such as "fraction of peak". Every measurement takes about 0.3 s.
///
/// With GCC on x86 each kernel is compiled for several instruction sets and the widest one is taken, as in the
/// library's own kernels.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <numeric>
#include <thread>
#include <vector>

#include "base/simd.hpp"

namespace bench::peak {

using llmt::Eight;
using llmt::lanes;

struct Product {
  template <int bytes>
  LLMT_INLINE static void update(Eight<bytes>& x, const Eight<bytes>& a, const Eight<bytes>& b) {
    x = x * a;
    x += b;
  }
};

struct FusedProduct {
  template <int bytes>
  LLMT_INLINE static void update(Eight<bytes>& x, const Eight<bytes>& a, const Eight<bytes>& b) {
    for (int part = 0; part < Eight<bytes>::count; ++part) {
      for (int k = 0; k < bytes / 8; ++k) {
        x.parts[part][k] = __builtin_fma(x.parts[part][k], a.parts[part][k], b.parts[part][k]);
      }
    }
  }
};

template <int bytes>
LLMT_INLINE Eight<bytes> eight_times(double value) {
  Eight<bytes> result;
  for (auto& part : result.parts) part = value - typename Eight<bytes>::Register{};
  return result;
}

/// `Chains` sequences x <- x a + b side by side. Which number of chains hides the latency without running out of
/// registers depends on the machine, so callers try several.
template <class Update, int Chains, int bytes>
LLMT_INLINE double chains(Eigen::Index steps, double factor, double term) {
  const auto a = eight_times<bytes>(factor);
  const auto b = eight_times<bytes>(term);
  Eight<bytes> x[Chains];
  for (int c = 0; c < Chains; ++c) x[c] = eight_times<bytes>(factor + static_cast<double>(c));
  for (Eigen::Index step = 0; step < steps; ++step) {
#pragma GCC unroll 32
    for (int c = 0; c < Chains; ++c) Update::update(x[c], a, b);
  }
  double sum = 0.0;
  for (const Eight<bytes>& chain : x) {
    for (int k = 0; k < lanes; ++k) sum += chain[k];
  }
  return sum;
}

template <int Chains>
double product(Eigen::Index steps, double factor, double term) {
  double result = 0.0;
  llmt::with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
    result = chains<Product, Chains, decltype(eight)::bytes>(steps, factor, term);
  });
  return result;
}

#ifdef LLMT_HAS_INSTRUCTION_SETS
// The library has no fused multiply-add, so its own choice of registers does not ask for it.
template <int Chains>
__attribute__((target("avx512f"))) double fused_512(Eigen::Index steps, double factor, double term) {
  return chains<FusedProduct, Chains, 64>(steps, factor, term);
}
template <int Chains>
__attribute__((target("avx2,fma"))) double fused_256(Eigen::Index steps, double factor, double term) {
  return chains<FusedProduct, Chains, 32>(steps, factor, term);
}
inline bool has_fused() { return __builtin_cpu_supports("fma") != 0 && __builtin_cpu_supports("avx2") != 0; }
template <int Chains>
double fused(Eigen::Index steps, double factor, double term) {
  const bool is_wide = __builtin_cpu_supports("avx512f") != 0;
  return is_wide ? fused_512<Chains>(steps, factor, term) : fused_256<Chains>(steps, factor, term);
}
#else
inline bool has_fused() { return false; }
template <int Chains>
double fused(Eigen::Index, double, double) {
  return 0.0;
}
#endif

inline double sum(const double* data, Eigen::Index size) {
  double result = 0.0;
  llmt::with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
    using Lanes = decltype(eight);
    Lanes parts[4] = {};
    for (Eigen::Index i = 0; i + 4 * lanes <= size; i += 4 * lanes) {
      for (Eigen::Index k = 0; k < 4; ++k) parts[k] += *reinterpret_cast<const Lanes*>(data + i + k * lanes);
    }
    for (const Lanes& part : parts) result += part[0];
  });
  return result;
}

/// Results are written here so that the compiler does not leave out the work.
inline volatile double sink = 0.0;

/// Work done in a second by `threads` threads together: work(thread) does a small piece and returns its amount. The
/// best of twenty short rounds, because other programs may disturb some of them.
template <class Work>
double rate(int threads, const Work& work, double seconds_per_round = 0.005) {
  double best = 0.0;
  for (int round = 0; round < 20; ++round) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const auto passed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
    std::vector<double> rates(threads);
    const auto run = [&](int thread) {
      double done = 0.0;
      const double begin = passed();
      while (passed() < begin + seconds_per_round) {
        done += work(thread);
      }
      rates[thread] = done / (passed() - begin);
    };
    std::vector<std::thread> others;
    for (int thread = 1; thread < threads; ++thread) {
      others.emplace_back(run, thread);
    }
    run(0);
    for (std::thread& other : others) {
      other.join();
    }
    best = std::max(best, std::accumulate(rates.begin(), rates.end(), 0.0));
  }
  return best;
}

struct Kernel {
  Eigen::Index chains;
  double (*run)(Eigen::Index steps, double factor, double term);
};

inline double flops(int threads, std::initializer_list<Kernel> kernels) {
  constexpr Eigen::Index steps = 10000;
  volatile double factor = 0.999;
  volatile double term = 0.001;
  double best = 0.0;
  for (const Kernel& kernel : kernels) {
    best = std::max(best, rate(threads, [&](int) {
                      sink = kernel.run(steps, factor, term);
                      return static_cast<double>(2 * lanes * kernel.chains * steps);
                    }));
  }
  return best;
}

}  // namespace bench::peak

namespace bench {

/// Floating-point operations per second of double vectors that are multiplied and then added: the limit of code that
/// is compiled without fused multiply-add.
inline double peak_product_flops(int threads = 1) {
  return peak::flops(threads,
                     {{4, peak::product<4>}, {6, peak::product<6>}, {12, peak::product<12>}, {24, peak::product<24>}});
}

/// The same with fused multiply-add; 0 if the machine has none.
inline double peak_fused_flops(int threads = 1) {
  if (!peak::has_fused()) return 0.0;
  return peak::flops(threads, {{4, peak::fused<4>}, {6, peak::fused<6>}, {12, peak::fused<12>}, {24, peak::fused<24>}});
}

/// Bytes per second that all threads together read in order from an array of `megabytes`, each thread its own part.
inline double peak_read_bandwidth(int threads = 1, Eigen::Index megabytes = 128) {
  constexpr Eigen::Index chunk = 1 << 15;  // doubles
  const Eigen::Index part = megabytes * 4 / threads * chunk;
  const std::vector<double> data(part * threads, 1.0);
  std::vector<Eigen::Index> position(threads, 0);
  return peak::rate(threads, [&](int thread) {
    Eigen::Index& at = position[thread];
    peak::sink = peak::sum(data.data() + thread * part + at, chunk);
    at = (at + chunk) % part;
    return static_cast<double>(chunk) * sizeof(double);
  });
}

}  // namespace bench
