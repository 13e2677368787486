/// \file
/// What this machine can do at most, for figures such as "fraction of peak". Every measurement takes about 0.3 s.
///
/// With GCC on x86 each kernel is compiled for several instruction sets and the loader takes the widest, as in the
/// library's own kernels.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <numeric>
#include <thread>
#include <vector>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define BENCH_FOR_EACH_INSTRUCTION_SET __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#define BENCH_HAS_FMA (__builtin_cpu_supports("fma") != 0)
#else
#define BENCH_FOR_EACH_INSTRUCTION_SET
#define BENCH_HAS_FMA false
#endif

namespace bench::peak {

typedef double Lanes __attribute__((vector_size(64), aligned(8)));  // NOLINT(modernize-use-using): clang
inline constexpr Eigen::Index lanes = 8;

struct Product {
  [[gnu::always_inline]] static void update(Lanes& x, const Lanes& a, const Lanes& b) { x = x * a + b; }
};

struct FusedProduct {
  [[gnu::always_inline]] static void update(Lanes& x, const Lanes& a, const Lanes& b) {
    for (Eigen::Index l = 0; l < lanes; ++l) {
      x[l] = __builtin_fma(x[l], a[l], b[l]);
    }
  }
};

/// `Chains` sequences x <- x a + b side by side. Which number of chains hides the latency without running out of
/// registers depends on the machine, so callers try several.
template <class Update, int Chains>
[[gnu::always_inline]] inline double chains(Eigen::Index steps, double factor, double term) {
  const Lanes a = factor - Lanes{};
  const Lanes b = term - Lanes{};
  Lanes x[Chains];
  for (int c = 0; c < Chains; ++c) {
    x[c] = a + static_cast<double>(c);
  }
  for (Eigen::Index step = 0; step < steps; ++step) {
#pragma GCC unroll 32
    for (int c = 0; c < Chains; ++c) {
      Update::update(x[c], a, b);
    }
  }
  double sum = 0.0;
  for (const Lanes& chain : x) {
    for (Eigen::Index l = 0; l < lanes; ++l) {
      sum += chain[l];
    }
  }
  return sum;
}

#define BENCH_KERNEL(name, Update, count)                              \
  BENCH_FOR_EACH_INSTRUCTION_SET                                       \
  inline double name(Eigen::Index steps, double factor, double term) { \
    return chains<Update, count>(steps, factor, term);                 \
  }
BENCH_KERNEL(product_6, Product, 6)
BENCH_KERNEL(product_12, Product, 12)
BENCH_KERNEL(product_24, Product, 24)
BENCH_KERNEL(fused_6, FusedProduct, 6)
BENCH_KERNEL(fused_12, FusedProduct, 12)
BENCH_KERNEL(fused_24, FusedProduct, 24)
#undef BENCH_KERNEL

BENCH_FOR_EACH_INSTRUCTION_SET
inline double sum(const double* data, Eigen::Index size) {
  Lanes parts[4] = {};
  for (Eigen::Index i = 0; i + 4 * lanes <= size; i += 4 * lanes) {
    for (Eigen::Index k = 0; k < 4; ++k) {
      parts[k] += *reinterpret_cast<const Lanes*>(data + i + k * lanes);
    }
  }
  return (parts[0] + parts[1] + parts[2] + parts[3])[0];
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
  return peak::flops(threads, {{6, peak::product_6}, {12, peak::product_12}, {24, peak::product_24}});
}

/// The same with fused multiply-add; 0 if the machine has none.
inline double peak_fused_flops(int threads = 1) {
  return BENCH_HAS_FMA ? peak::flops(threads, {{6, peak::fused_6}, {12, peak::fused_12}, {24, peak::fused_24}}) : 0.0;
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
