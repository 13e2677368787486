// States to go on from, with changed content and the checksum that goes with it: of fits beyond memory, and of streams.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "hostile/lists.hpp"
#include "llmt/files.hpp"
#include "llmt/random.hpp"
#include "llmt/stream.hpp"
#include "oracles/state_files.hpp"

namespace hostile {
namespace {

using Json = nlohmann::json;

std::string table(int rows) {
  llmt::Random random(3);
  std::string text = "a,b,y\n";
  for (int i = 0; i < rows; ++i) {
    const double a = random.uniform(-1.0, 1.0);
    text += fmt::format("{},{},{}\n", a, random.uniform(-1.0, 1.0), 2.0 * std::abs(a) + 0.05 * random.normal());
  }
  return text;
}

// Words of eight bytes are replaced, bits flipped, bytes left out or repeated.
std::string changed_content(std::string content, llmt::Random& random) {
  const std::array<std::uint64_t, 12> words = {0,
                                               1,
                                               2,
                                               ~std::uint64_t{0},
                                               255,
                                               1 << 20,
                                               std::uint64_t{1} << 40,
                                               std::uint64_t{1} << 62,
                                               0x7ff0000000000000ULL,   // infinity
                                               0x7ff8000000000000ULL,   // NaN
                                               0x7fe0000000000000ULL,   // 9e307
                                               0xffe0000000000000ULL};  // the same below 0
  const std::size_t changes = 1 + random.below(2);
  for (std::size_t k = 0; k < changes; ++k) {
    const std::size_t at = random.below(content.size());
    const std::size_t kind = random.below(8);
    if (kind < 5 && at / 8 * 8 + 8 <= content.size()) {
      std::memcpy(content.data() + at / 8 * 8, &words[random.below(words.size())], 8);
    }
    if (kind == 5) content[at] = static_cast<char>(content[at] ^ (1 << random.below(8)));
    if (kind == 6) content.erase(at / 8 * 8, 8);
    if (kind == 7) content.insert(at / 8 * 8, content.substr(at / 8 * 8, 8));
  }
  return content;
}

void ask_fits(List& list, const std::string& program) {
  write("d.csv", table(3000));
  if (run({program, "table", "d.csv", "-o", "d.arrow"}, {}).exit_code != 0) throw std::runtime_error("no table");
  // Blocks of rows are fewer where a fit may take less memory, so that both have states of all kinds.
  for (const char* memory : {"100K", "4M"}) {
    const std::vector<std::string> fit = {program, "fit",  "d.arrow", "-t",        "y", "--memory",
                                          memory,  "--cv", "0",       "--threads", "1"};
    std::vector<std::string> resume = fit;
    resume.insert(resume.end(), {"--checkpoint", "evil.state", "--resume"});
    // Each pass writes a state to a pipe, one behind the other.
    const std::string command =
        fmt::format("{} fit d.arrow -t y --memory {} --cv 0 --checkpoint /dev/stdout | cat", program, memory);
    const Outcome passes = run({"/bin/sh", "-c", command}, {.seconds = 60.0});
    const std::vector<std::string> states = state_files::split(passes.out);
    if (states.size() < 2) throw std::runtime_error("no states: " + passes.err);
    llmt::Random random(57);
    for (std::size_t k = 0; k < states.size(); ++k) {
      write("evil.state", states[k]);
      list.ask(fmt::format("{}: state {} of {}", memory, k + 1, states.size()), resume, "evil.state");
      const int count = static_cast<int>(300 / states.size());
      for (int each = 0; each < count; ++each) {
        write("evil.state",
              state_files::sealed_as(states[k], changed_content(state_files::content(states[k]), random)));
        list.ask(fmt::format("{}: state {}, change {}", memory, k + 1, each), resume, "evil.state");
      }
    }
    write("evil.state", states.back().substr(0, states.back().size() - 1));
    list.ask("a byte less", resume, "evil.state");
    write("evil.state", "");
    list.ask("an empty state", resume, "evil.state");
  }
}

// A value somewhere in the text.
Json& random_value(Json& json, llmt::Random& random) {
  Json* at = &json;
  while (at->is_structured() && !at->empty()) {
    auto next = at->begin();
    std::advance(next, random.below(at->size()));
    at = &*next;
  }
  return *at;
}

// A chain of splits: the left child is split again.
Json chain(const Json& stream, int splits) {
  Json result = stream;
  Json& nodes = result["trees"][0]["nodes"];
  Json inner;
  Json leaf;
  for (const Json& node : nodes) (node.contains("split") ? inner : leaf) = node;
  if (inner.is_null()) throw std::runtime_error("no split in the base stream");
  inner.erase("alternate");
  for (const char* part : {"alternate", "search"}) leaf.erase(part);
  nodes = Json::array();
  for (int k = 0; k < splits; ++k) {
    inner["split"]["left"] = 2 * k + 1;
    inner["split"]["right"] = 2 * k + 2;
    nodes.push_back(inner);
    if (k > 0) nodes.push_back(leaf);
  }
  nodes.push_back(leaf);
  nodes.push_back(leaf);
  return result;
}

void ask_streams(List& list, const std::string& self) {
  llmt::Random random(5);
  const auto rows = [&](Eigen::Index count, llmt::Stream& stream) {
    Eigen::MatrixXd inputs(count, 1);
    for (Eigen::Index i = 0; i < count; ++i) inputs(i, 0) = random.uniform(-1.0, 1.0);
    stream.add(inputs, inputs.cwiseAbs() * 2.0);
  };
  llmt::Stream stream(1, 1);
  rows(10, stream);
  const Json young = Json::parse(to_json(stream));
  rows(4000, stream);
  const Json old = Json::parse(to_json(stream));
  const auto ask = [&](const std::string& name, const std::string& text) {
    write("evil.stream", text);
    list.ask(name, {self, "--stream", "evil.stream"}, "evil.stream");
  };
  ask("a young stream", young.dump());
  ask("an old stream", old.dump());
  for (const int splits : {100, 2000, 2001, 20000})
    ask(fmt::format("a chain of {}", splits), chain(old, splits).dump());
  constexpr int deep = 100000;
  ask("100000 brackets", std::string(deep, '['));
  const std::vector<Json> values = {0,   -1,  1,       2,   1e308, -1e308,        1e-308,         9223372036854775807LL,
                                    1e6, 0.5, nullptr, "x", true,  Json::array(), Json::object(), Json::array({1, 2})};
  for (int k = 0; k < 350; ++k) {
    Json json = k % 4 == 0 ? young : old;
    const std::size_t changes = 1 + random.below(2);
    for (std::size_t each = 0; each < changes; ++each) random_value(json, random) = values[random.below(values.size())];
    ask(fmt::format("changed values {}", k), json.dump());
  }
}

}  // namespace

void ask_states(List& list, const std::string& program, const std::string& self) {
  ask_fits(list, program);
  ask_streams(list, self);
}

int go_on_from_stream(const std::string& file) {
  try {
    llmt::Stream stream = llmt::stream_from_json(llmt::read_file(file), file);
    const Eigen::MatrixXd inputs = Eigen::VectorXd::LinSpaced(500, -1.0, 1.0);
    try {
      stream.predict(inputs);
      stream.add(inputs, inputs);
      stream.snapshot();
      to_json(stream);
    } catch (const std::exception& error) {
      throw std::runtime_error(fmt::format("{}: {}", file, error.what()));
    }
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}

}  // namespace hostile
