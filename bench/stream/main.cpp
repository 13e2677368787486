// stream: what llmt::Stream learns, how fast it follows a change, and what it costs.
#include "program.hpp"
#include "stream/stream.hpp"

int main(int argc, char** argv) {
  return bench::run_program("stream", "What streams learn and cost", argc, argv, bench::add_alarms, bench::add_drift,
                            bench::add_merged, bench::add_scaling, bench::add_sets, bench::add_spread);
}
