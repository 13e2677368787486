// llmt-mpi: `llmt fit` of an Arrow file by the processes of an MPI job.
#include <mpi.h>

#include <chrono>

#include "distributed/mpi/mpi_processes.hpp"
#include "llmt/arrow.hpp"
#include "shared/cli.hpp"
#include "shared/help.hpp"
#include "shared/options.hpp"
#include "trees/fit_options.hpp"

namespace {

using namespace llmt::apps;

int run_program(int argc, char** argv) {
  CLI::App app{
      "Fits a tree to a table in Arrow files that all processes can read.\n"
      "The options are those of llmt fit for Arrow files. The model has the same bytes for any number of processes. A "
      "process that fails or dies ends the job; --resume goes on from the last pass.",
      "llmt-mpi"};
  app.footer("Example: mpirun -n 16 llmt-mpi year.arrow --target y --checkpoint year.state --resume -o model.json");
  app.set_help_all_flag("--help-all", "Help with all options, also those for experts");
  ArrowFitArguments arguments;
  add_learning_options(app, arguments.learning);
  add_fit_options(app, arguments.learning.options, arguments.learning.columns);
  add_output_file(app, "-o,--output", arguments.output, "Model file to write");
  app.add_flag("--json", arguments.json, "Print the summary as JSON");
  add_arrow_fit_options(app, arguments);
  double patience = 86400.0;
  add_number(
      app, "--patience", patience, llmt::above_zero,
      "Seconds that a process waits for another before the job ends; the first one also fits branches meanwhile");
  require_forms(app);
  app.callback([&] {
    for (const std::string& file : arguments.files()) {
      if (!llmt::is_arrow_file(file)) throw std::invalid_argument(file + ": is no Arrow file; llmt table makes one");
    }
    MpiProcesses processes{std::chrono::duration<double>(patience)};
    arrow_fit_command(app, arguments, processes);
  });
  return run(app, argc, argv, setting_names());
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  const int code = run_program(argc, argv);
  // The others may wait for this one.
  if (code != exit_done) MPI_Abort(MPI_COMM_WORLD, code);
  MPI_Finalize();
  return code;
}
