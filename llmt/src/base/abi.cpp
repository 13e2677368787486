#include "llmt/abi.hpp"

namespace llmt::abi {

const char LLMT_ABI_TAG = 0;

}  // namespace llmt::abi
