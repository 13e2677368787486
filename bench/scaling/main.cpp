// scaling: how time and memory of a fit grow, and what the machine can do at most.
#include "program.hpp"
#include "scaling/scaling.hpp"

int main(int argc, char** argv) {
  return bench::run_program("scaling", "Time and memory of whole fits, and the peak of the machine", argc, argv,
                            bench::add_fits, bench::add_roofline);
}
