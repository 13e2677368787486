#include <iostream>

#include "llmt/robotics/robotics.hpp"

int main() {
  std::cout << (llmt::abi::tag != nullptr ? "consumer ok\n" : "no tag\n");
  return 0;
}
