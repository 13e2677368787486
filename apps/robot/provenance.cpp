#include "robot/provenance.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/evp.h>

#include <array>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "llmt/files.hpp"
#include "shared/options.hpp"

namespace llmt::apps {
namespace {

std::string today() {
  std::time_t now = std::time(nullptr);
  if (const char* epoch = std::getenv("SOURCE_DATE_EPOCH"); epoch != nullptr && *epoch != '\0') {
    now = static_cast<std::time_t>(read_number("SOURCE_DATE_EPOCH", epoch, {0.0, 1e11, "seconds since 1970"}));
  }
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(now));
}

}  // namespace

void add_stated(CLI::App& command, Stated& stated) {
  command.add_option(
      "--instrument", stated.instrument,
      "For the record: what measured, as \"AT960, 750123\"; written into the description, JSON and page");
  command.add_option("--serial-number", stated.serial_number, "For the record: the robot's serial number");
}

std::string sha256(const std::string& bytes) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned int size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1) {
    throw std::runtime_error("SHA-256 is not to be had from libcrypto");
  }
  std::string text;
  for (unsigned int k = 0; k < size; ++k) text += fmt::format("{:02x}", digest[k]);
  return text;
}

robotics::Provenance provenance_of(const CLI::App& command,
                                   const std::vector<std::pair<std::string, std::string>>& files,
                                   const Stated& stated) {
  static const std::set<std::string> without_effect = {"--output",  "--report",  "--plot",       "--json",
                                                       "--threads", "--quality", "--instrument", "--serial-number"};
  robotics::Provenance made;
  made.program = "llmt-robot " LLMT_VERSION;
  made.date = today();
  made.instrument = stated.instrument;
  made.serial_number = stated.serial_number;
  for (const auto& [role, path] : files) {
    if (path.empty()) continue;
    // A pipe has been read once and gives nothing again.
    const bool is_file = std::filesystem::is_regular_file(path);
    made.sources.push_back({role, std::filesystem::path(path).filename().string(),
                            is_file ? sha256(read_file(path)) : "not known: no regular file"});
  }
  for (const CLI::Option* option : command.get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || !name.starts_with("--") || without_effect.contains(name)) continue;
    const bool is_flag = option->get_items_expected_max() == 0;
    made.options.push_back(is_flag ? name : fmt::format("{} {}", name, fmt::join(option->results(), " ")));
  }
  return made;
}

}  // namespace llmt::apps
