#define LLMT_DECOMPOSITION template
#include "base/decompositions.hpp"
