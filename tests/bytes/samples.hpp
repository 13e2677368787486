// Data for the test of bytes, the same on every machine: made with + - * / and sqrt alone.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace bytes {

/// A linear congruential generator (Knuth's MMIX constants) with a mixed output, on its own, so that the data stay as
/// they are when the library's generator changes.
class Generator {
 public:
  explicit Generator(std::uint64_t seed) : state_(seed) {}
  double uniform();  ///< on [0, 1)
  double noise();    ///< sum of four uniform numbers, mean 0, standard deviation 0.58

 private:
  std::uint64_t state_;
};

struct Sample {
  Eigen::MatrixXd inputs;   ///< rows x 3
  Eigen::MatrixXd outputs;  ///< rows x 1, or x 2
};

/// Three inputs of different scales; a jump, a ridge, a product, a root and noise. The output rises with the first
/// input throughout.
Sample make_sample(Eigen::Index rows, std::uint64_t seed);

/// Adds a second output, that jumps and bends where the first does, and elsewhere.
void add_output(Sample& sample);

/// Every seventh value of the first input and every eleventh of the third become NaN.
void remove_values(Eigen::MatrixXd& inputs);

/// The third input becomes a category 0 ... 4, of which 4 is rare; the output moves with it.
void make_categorical(Sample& sample);

/// Rows of weight 0, 1/2, 1 and 3.
Eigen::VectorXd make_weights(Eigen::Index rows);

/// Points to predict: inside the sample's range and beyond it.
Eigen::MatrixXd make_queries();

/// CSV text with all digits. NaN: an empty cell.
std::string to_csv(const std::vector<std::string>& names, const Eigen::MatrixXd& columns);

}  // namespace bytes
