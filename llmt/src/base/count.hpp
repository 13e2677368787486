/// \file
/// Counts as int.
#pragma once

#include <iterator>

namespace llmt {

/// The number of elements of a container, as the type in which rows, nodes, leaves, inputs and bins are numbered. There
/// are never more than 2^31 of them: the table of data refuses more rows, and the others are no more than rows.
template <class Container>
int count_of(const Container& container) {
  return static_cast<int>(std::ssize(container));
}

}  // namespace llmt
