#include "llmt/abi.hpp"

int main() {}
