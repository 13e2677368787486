// rival_write_sample ROWS INPUTS SEED TRAIN TEST: writes the function of synthetic.hpp as the rivals' runners read it,
// doubles column after column: inputs, then the output. TRAIN has ROWS rows with noise, TEST 100000 fresh ones without.
#include <fstream>
#include <iostream>

#include "synthetic.hpp"

namespace {

void write(const char* path, const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(x.data()), x.size() * static_cast<std::streamsize>(sizeof(double)));
  file.write(reinterpret_cast<const char*>(y.data()), y.size() * static_cast<std::streamsize>(sizeof(double)));
  file.close();
  if (!file) {
    throw std::runtime_error(std::string(path) + ": cannot be written");
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "usage: rival_write_sample ROWS INPUTS SEED TRAIN TEST\n";
    return 2;
  }
  try {
    const Eigen::Index inputs = std::stol(argv[2]);
    const std::uint64_t seed = std::stoull(argv[3]);
    const bench::Sample train = bench::sample(std::stol(argv[1]), inputs, 2 * seed - 1);
    write(argv[4], train.x, train.y);
    const bench::Sample test = bench::sample(100000, inputs, 2 * seed);
    write(argv[5], test.x, test.truth);
  } catch (const std::exception& error) {
    std::cerr << "rival_write_sample: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
