#include "partition/leverage.hpp"

#include "base/simd.hpp"
#include "partition/imputed.hpp"

namespace llmt {
namespace {

// a' G a of a symmetric matrix; `a` is padded with zeros to whole quads.
LLMT_FOR_EACH_INSTRUCTION_SET
double quadratic_form(const double* gram, Eigen::Index size, const double* a) {
  Quad sum = {};
  for (Eigen::Index i = 0; i < size; i += quad) {
    Quad product = {};
    for (Eigen::Index j = 0; j < size; ++j) {
      product += a[j] * load_quad(gram + j * size + i, size - i);
    }
    sum += load_quad(a + i) * product;
  }
  return sum_of(sum);
}

}  // namespace

void leverages(const Node& leaf, const RowList& list, const RowBlock& block, std::vector<double>& result) {
  result.assign(list.count, 0.0);
  if (leaf.inverse_gram.size() == 0) return;
  const Eigen::Index size = leaf.inverse_gram.rows();
  std::vector<double> a(padded_to_quads(size), 0.0);
  a[0] = 1.0;
  for (Eigen::Index i = 0; i < list.count; ++i) {
    const double* deviations = block.deviations.data() + list.rows[i] * block.stride;
    for (Eigen::Index k = 0; k + 1 < size; ++k) {
      a[k + 1] = imputed(leaf, k, deviations[k]);
    }
    result[i] = quadratic_form(leaf.inverse_gram.data(), size, a.data());
  }
}

}  // namespace llmt
