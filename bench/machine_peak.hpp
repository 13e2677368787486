/// \file
/// What this machine can do at most, for figures such as "fraction of peak". Every measurement takes some 0.3 s.
///
/// With GCC on x86 each kernel exists for several instruction sets and the loader takes the widest, as in the library's
/// own kernels.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <initializer_list>
#include <numeric>
#include <thread>
#include <vector>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define BENCH_FOR_EACH_INSTRUCTION_SET __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#define BENCH_HAS_FMA (__builtin_cpu_supports("fma") != 0)
#else
#define BENCH_FOR_EACH_INSTRUCTION_SET
#define BENCH_HAS_FMA false
#endif

namespace bench::peak {

using Lanes = double __attribute__((vector_size(64), aligned(8)));
inline constexpr std::ptrdiff_t lanes = 8;

struct Product {
  [[gnu::always_inline]] static void update(Lanes& x, const Lanes& a, const Lanes& b) { x = x * a + b; }
};

struct FusedProduct {
  [[gnu::always_inline]] static void update(Lanes& x, const Lanes& a, const Lanes& b) {
    for (std::ptrdiff_t l = 0; l < lanes; ++l) {
      x[l] = __builtin_fma(x[l], a[l], b[l]);
    }
  }
};

/// `Chains` sequences x <- x a + b side by side. How many hide the latency without running out of registers depends on
/// the machine, so callers try several.
template <class Update, int Chains>
[[gnu::always_inline]] inline double chains(std::ptrdiff_t steps, double factor, double term) {
  const Lanes a = factor - Lanes{};
  const Lanes b = term - Lanes{};
  Lanes x[Chains];
  for (int c = 0; c < Chains; ++c) {
    x[c] = a + static_cast<double>(c);
  }
  for (std::ptrdiff_t step = 0; step < steps; ++step) {
#pragma GCC unroll 32
    for (int c = 0; c < Chains; ++c) {
      Update::update(x[c], a, b);
    }
  }
  double sum = 0.0;
  for (const Lanes& chain : x) {
    for (std::ptrdiff_t l = 0; l < lanes; ++l) {
      sum += chain[l];
    }
  }
  return sum;
}

#define BENCH_KERNEL(name, Update, count)                                \
  BENCH_FOR_EACH_INSTRUCTION_SET                                         \
  inline double name(std::ptrdiff_t steps, double factor, double term) { \
    return chains<Update, count>(steps, factor, term);                   \
  }
BENCH_KERNEL(product_6, Product, 6)
BENCH_KERNEL(product_12, Product, 12)
BENCH_KERNEL(product_24, Product, 24)
BENCH_KERNEL(fused_6, FusedProduct, 6)
BENCH_KERNEL(fused_12, FusedProduct, 12)
BENCH_KERNEL(fused_24, FusedProduct, 24)
#undef BENCH_KERNEL

BENCH_FOR_EACH_INSTRUCTION_SET
inline double sum(const double* data, std::ptrdiff_t size) {
  Lanes parts[4] = {};
  for (std::ptrdiff_t i = 0; i + 4 * lanes <= size; i += 4 * lanes) {
    for (std::ptrdiff_t k = 0; k < 4; ++k) {
      parts[k] += *reinterpret_cast<const Lanes*>(data + i + k * lanes);
    }
  }
  return (parts[0] + parts[1] + parts[2] + parts[3])[0];
}

/// Where results go that nobody wants, so that the compiler does not leave out the work.
inline volatile double sink = 0.0;

/// How much `threads` threads get done in a second: work(thread) does a little and returns how much. The best of twenty
/// short rounds, since other programs may disturb some.
template <class Work>
double rate(int threads, const Work& work, double seconds_per_round = 0.005) {
  double best = 0.0;
  for (int round = 0; round < 20; ++round) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const auto passed = [&] { return std::chrono::duration<double>(Clock::now() - start).count(); };
    std::vector<double> rates(static_cast<std::size_t>(threads));
    const auto run = [&](int thread) {
      double done = 0.0;
      const double begin = passed();
      while (passed() < begin + seconds_per_round) {
        done += work(thread);
      }
      rates[static_cast<std::size_t>(thread)] = done / (passed() - begin);
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
  std::ptrdiff_t chains;
  double (*run)(std::ptrdiff_t steps, double factor, double term);
};

inline double flops(int threads, std::initializer_list<Kernel> kernels) {
  constexpr std::ptrdiff_t steps = 10000;
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

/// Floating-point operations a second of double vectors, multiplied and then added: what code can reach that may not
/// fuse the two.
inline double peak_product_flops(int threads = 1) {
  return peak::flops(threads, {{6, peak::product_6}, {12, peak::product_12}, {24, peak::product_24}});
}

/// The same with fused multiply-add; 0 where the machine has none.
inline double peak_fused_flops(int threads = 1) {
  return BENCH_HAS_FMA ? peak::flops(threads, {{6, peak::fused_6}, {12, peak::fused_12}, {24, peak::fused_24}}) : 0.0;
}

/// Bytes a second, read in order from an array of `megabytes` by all threads together, each its part.
inline double peak_read_bandwidth(int threads = 1, std::ptrdiff_t megabytes = 128) {
  constexpr std::ptrdiff_t chunk = 1 << 15;  // doubles
  const std::ptrdiff_t part = megabytes * 4 / threads * chunk;
  const std::vector<double> data(static_cast<std::size_t>(part * threads), 1.0);
  std::vector<std::ptrdiff_t> position(static_cast<std::size_t>(threads), 0);
  return peak::rate(threads, [&](int thread) {
    std::ptrdiff_t& at = position[static_cast<std::size_t>(thread)];
    peak::sink = peak::sum(data.data() + thread * part + at, chunk);
    at = (at + chunk) % part;
    return static_cast<double>(chunk) * sizeof(double);
  });
}

}  // namespace bench
