// What this machine can do at most, as a reference for the figures of kernels: arithmetic on double vectors and memory
// bandwidth, with one thread and with two. Takes about ten seconds.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

#include "llmt/random.hpp"
#include "machine_peak.hpp"
#include "scaling/scaling.hpp"

namespace bench {
namespace {

constexpr Eigen::Index row_size = 12;  // doubles, 96 bytes

double sum_rows(const double* data, const std::uint32_t* rows, Eigen::Index count) {
  double sum = 0.0;
  llmt::with_widest_registers([&](auto eight) LLMT_INLINE_LAMBDA {
    decltype(eight) first = {};
    llmt::Quad last = {};
    for (Eigen::Index i = 0; i < count; ++i) {
      const double* row = data + row_size * rows[i];
      first += *reinterpret_cast<const decltype(eight)*>(row);
      last += llmt::load_quad(row + 8);
    }
    sum = first[0] + last[0];
  });
  return sum;
}

// Rows a second, read one after the other or in random order.
double gather(int threads, Eigen::Index rows, bool random) {
  constexpr Eigen::Index chunk = 4096;
  const Eigen::Index chunks = rows / chunk / threads;  // of each thread
  const std::vector<double> data(rows * row_size, 1.0);
  std::vector<std::uint32_t> order(rows);
  std::iota(order.begin(), order.end(), 0);
  if (random) {
    std::ranges::transform(llmt::Random(1).permutation(rows), order.begin(),
                           [](Eigen::Index row) { return static_cast<std::uint32_t>(row); });
  }
  std::vector<Eigen::Index> position(threads, 0);
  return peak::rate(threads, [&](int thread) {
    Eigen::Index& at = position[thread];
    peak::sink = sum_rows(data.data(), order.data() + (thread * chunks + at) * chunk, chunk);
    at = (at + 1) % chunks;
    return static_cast<double>(chunk);
  });
}

// Bytes a second, read and written.
double copy(int threads) {
  constexpr Eigen::Index chunk = 1 << 18;
  const Eigen::Index chunks = (Eigen::Index{256} << 20) / chunk / threads;  // of each thread
  const std::vector<char> from(chunks * chunk * threads, 1);
  std::vector<char> to(from.size());
  std::vector<Eigen::Index> position(threads, 0);
  const double result = peak::rate(threads, [&](int thread) {
    Eigen::Index& at = position[thread];
    const Eigen::Index offset = (thread * chunks + at) * chunk;
    std::memcpy(to.data() + offset, from.data() + offset, chunk);
    at = (at + 1) % chunks;
    return 2.0 * chunk;
  });
  peak::sink = to[to.size() / 2];
  return result;
}

// Of three tries, some time apart.
template <class Measured>
double best(const Measured& measured, int threads) {
  return std::max({measured(threads), measured(threads), measured(threads)});
}

template <class Measured>
void print(const char* name, const Measured& measured) {
  fmt::print("{:58} {:10.1f} {:10.1f}\n", name, 1e-9 * best(measured, 1), 1e-9 * best(measured, 2));
}

template <class Measured>
void print_rows(const char* name, const Measured& measured) {
  const double one = best(measured, 1);
  const double two = best(measured, 2);
  fmt::print("{:58} {:10.1f} {:10.1f}   {:.1f} ns a row, {:.1f}\n", name, 96e-9 * one, 96e-9 * two, 1e9 / one,
             1e9 / two);
}

void roofline() {
  fmt::print("{:58} {:>10} {:>10}\n", "", "1 thread", "2 threads");
  print("multiply, then add, Gflop/s", peak_product_flops);
  print("fused multiply-add, Gflop/s", peak_fused_flops);
  print("read 256 MB, GB/s", [](int threads) { return peak_read_bandwidth(threads, 256); });
  print("copy 256 MB, GB/s read and written", copy);
  constexpr Eigen::Index large = 1000000;  // 96 MB
  constexpr Eigen::Index small = 52083;    // 5 MB
  print_rows("rows of 96 bytes out of 96 MB, in order, GB/s", [](int t) { return gather(t, large, false); });
  print_rows("rows of 96 bytes out of 96 MB, in random order, GB/s", [](int t) { return gather(t, large, true); });
  print_rows("rows of 96 bytes out of 5 MB, in order, GB/s", [](int t) { return gather(t, small, false); });
  print_rows("rows of 96 bytes out of 5 MB, in random order, GB/s", [](int t) { return gather(t, small, true); });
}

}  // namespace

void add_roofline(CLI::App& program) {
  program.add_subcommand("roofline", "Peak arithmetic and bandwidth of this machine, one and two threads")
      ->callback(roofline);
}

}  // namespace bench
