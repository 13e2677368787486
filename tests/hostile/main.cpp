// hostile_inputs LIST...: runs the programs on inputs that were made to break them, and prints a line per input with
// its state. LIST: urdf, mechanism, model, sum, found, name, arrow, state, largest. The exit code is 1 if one of them
// does not end as the threat model says: by a signal, after 5 s, beyond 1 GiB, or refused without the file's name.
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <string_view>

#include "hostile/lists.hpp"

int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  if (argc == 3 && std::string_view(argv[1]) == "--stream") return hostile::go_on_from_stream(argv[2]);
  const std::string self = fs::canonical("/proc/self/exe").string();
  const fs::path folder = fs::temp_directory_path() / fmt::format("llmt_hostile_{}", ::getpid());
  fs::create_directories(folder);
  fs::current_path(folder);
  hostile::List list;
  for (int k = 1; k < argc; ++k) {
    const std::string_view which = argv[k];
#ifdef LLMT_ROBOT_PROGRAM
    if (which == "urdf") hostile::ask_urdfs(list, LLMT_ROBOT_PROGRAM);
    if (which == "mechanism") hostile::ask_mechanisms(list, LLMT_ROBOT_PROGRAM);
    if (which == "largest") hostile::ask_largest(list, LLMT_PROGRAM, LLMT_ROBOT_PROGRAM);
#endif
    if (which == "model") hostile::ask_models(list, LLMT_PROGRAM);
    if (which == "arrow") hostile::ask_arrow_files(list, LLMT_PROGRAM);
    if (which == "state") hostile::ask_states(list, LLMT_PROGRAM, self);
    if (which == "found") hostile::ask_found_files(list, LLMT_PROGRAM);
    if (which == "sum") hostile::ask_sums(list, LLMT_PROGRAM);
    if (which == "name") hostile::ask_names(list, LLMT_PROGRAM);
  }
  fs::current_path(fs::temp_directory_path());
  fs::remove_all(folder);
  fmt::print("{} inputs, {} not as the threat model says\n", list.cases(), list.bad());
  return list.bad() == 0 && list.cases() > 0 ? 0 : 1;
}
