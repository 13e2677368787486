// States and sums of a fit as bytes, changed behind the checksum: they are refused by their name, or a fit goes on from
// them to a model or a refusal.
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "distributed/state.hpp"
#include "fuzz/fuzz.hpp"
#include "llmt/distributed.hpp"
#include "llmt/random.hpp"

namespace fuzz_sums {
namespace {

using namespace llmt::distributed;

constexpr Eigen::Index block_rows = 40;

struct Table {
  Eigen::MatrixXd inputs;
  Eigen::VectorXd output;
  Eigen::VectorXd weights;
};

const Table& table() {
  static const Table rows = [] {
    llmt::Random random(1);
    Table made{Eigen::MatrixXd(360, 3), Eigen::VectorXd(360), Eigen::VectorXd(360)};
    for (double& value : made.inputs.reshaped()) value = random.uniform(-1.0, 1.0);
    for (Eigen::Index i = 0; i < 360; ++i) {
      made.inputs(i, 2) = static_cast<double>(i % 3);
      made.weights(i) = static_cast<double>(i % 4);
    }
    made.output = made.inputs.col(0).cwiseAbs() + 0.1 * made.inputs.col(1) + made.inputs.col(2);
    return made;
  }();
  return rows;
}

Sums sums_of_all(const State& state) { return sums({table().inputs, table().output, 0, table().weights}, state, 1); }

// The bytes of all states of a fit, and of the sums that they ask for.
const std::vector<std::string>& stages() {
  static const std::vector<std::string> all = [] {
    Options options{.branch_rows = 130, .sample_rows = 100, .block_rows = block_rows, .weighted = true};
    options.levels = {{}, {}, {"r", "s", "t"}};
    options.fit.max_leaves = 2;
    options.fit.folds.count = 0;
    options.fit.validity = llmt::ValidityChoice::crisp;
    std::vector<std::string> bytes;
    State state = start({"a", "b", "c"}, "y", options);
    while (!state.finished()) {
      Sums next = sums_of_all(state);
      bytes.push_back(state.to_bytes());
      bytes.push_back(next.to_bytes());
      state = advance(state, std::move(next), {}, 1);
    }
    bytes.push_back(state.to_bytes());
    return bytes;
  }();
  return all;
}

// With a header that goes with the changed content.
std::string changed(std::string sealed_bytes, char kind, fuzz::Bytes& bytes) {
  std::string content(unsealed(kind, sealed_bytes, "stage"));
  while (!bytes.empty() && !content.empty()) {
    const auto at = static_cast<std::size_t>(bytes.below(65536) * 256 + bytes.byte()) % content.size();
    switch (bytes.below(8)) {
      case 0:
        content.resize(at);
        break;
      case 1:
        content.insert(at, 8, static_cast<char>(bytes.byte()));
        break;
      case 2: {
        const double number = bytes.number();
        std::memcpy(content.data() + at / 8 * 8, &number, std::min(sizeof number, content.size() - at / 8 * 8));
        break;
      }
      default:
        content[at] = static_cast<char>(bytes.coin() ? bytes.below(8) : bytes.byte());
    }
  }
  return sealed(kind, content);
}

void go_on(const State& state) {
  try {
    if (state.finished()) {
      state.model().predict(table().inputs, 1);
    } else if (state.step() != Step::gather) {  // a fit takes too long for a target
      advance(state, sums_of_all(state), {}, 1);
    }
  } catch (const std::exception& error) {
    fuzz::require(error.what()[0] != '\0', "a refusal says why");
  }
}

}  // namespace

FUZZ_TARGET(sums) {
  fuzz::Bytes bytes(data, size);
  const int stage = bytes.below(static_cast<int>(stages().size()));
  const bool is_state = stage % 2 == 0;
  const std::string text = changed(stages()[stage], is_state ? 's' : '+', bytes);
  try {
    if (is_state) {
      const State state = State::from_bytes(text, "t");
      fuzz::require(state.to_bytes() == text, "a state survives writing");
      go_on(state);
    } else {
      Sums read = Sums::from_bytes(text, "t");
      fuzz::require(read.to_bytes() == text, "sums survive writing");
      try {
        advance(State::from_bytes(stages()[stage - 1]), merge(std::move(read), Sums()), {}, 1);
      } catch (const std::exception& error) {
        fuzz::require(error.what()[0] != '\0', "a refusal says why");
      }
    }
  } catch (const std::runtime_error& error) {
    fuzz::require(std::string(error.what()).starts_with("t: "), fmt::format("'{}' names the bytes", error.what()));
  }
  return 0;
}

}  // namespace fuzz_sums
