#include "distributed/state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <set>
#include <stdexcept>

#include "llmt/intervals.hpp"
#include "stream/sums.hpp"

namespace llmt::distributed {
namespace {

constexpr std::string_view format = "LLMTSUMS";
constexpr std::uint32_t version = 4;

struct Header {
  char format[8];
  std::uint32_t version;
  std::uint32_t kind;
  std::uint64_t length;
  std::uint64_t checksum;
};
static_assert(sizeof(Header) == 32);

// FNV-1a over words of eight bytes, with a last step of splitmix64.
std::uint64_t hash_of(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325ULL + bytes.size();
  for (; !bytes.empty(); bytes.remove_prefix(std::min<std::size_t>(8, bytes.size()))) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), std::min<std::size_t>(8, bytes.size()));
    hash = (hash ^ word) * 0x100000001b3ULL;
    hash ^= hash >> 29;
  }
  hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9ULL;
  return hash ^ (hash >> 31);
}

void require(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(std::string(what) + " does not go with the rest");
}

bool finite(const Eigen::VectorXd& values) { return values.allFinite(); }

void check_node(const StateData& data, Eigen::Index at) {
  const TopNode& node = data.nodes[at];
  const Eigen::Index inputs = data.inputs();
  const Eigen::Index size = data.shape().size();
  const Eigen::Index coefficients = data.shape().coefficients();
  require(node.fate >= Fate::open && node.fate <= Fate::done, "what becomes of a node");
  require(node.rows >= 0 && node.rows <= data.rows, "the number of rows of a node");
  require(std::isfinite(node.weight) && node.weight >= 0.0, "the weight of a node");
  require(node.base.size() == coefficients && finite(node.base), "the model of a node");
  const bool known = node.fate == Fate::inner || node.fate == Fate::leaf;
  require(!known || (std::ssize(node.gram) == size && std::ssize(node.held_out) == size &&
                     node.low.size() == coefficients - 1 && node.high.size() == coefficients - 1 && finite(node.low) &&
                     finite(node.high)),
          "the sums of a node");
  if (node.fate != Fate::inner) return;
  const Eigen::Index nodes = std::ssize(data.nodes);
  require(node.left > at && node.right == node.left + 1 && node.right < nodes && node.left % 2 == 1,
          "a child of a node");
  require(node.input >= 0 && node.input < inputs && std::isfinite(node.threshold) &&
              node.level_side.size() == data.levels[node.input].size() &&
              std::ranges::all_of(node.level_side, [](Eigen::Index side) { return side >= -1 && side <= 1; }),
          "the split of a node");
}

void check_nodes(const StateData& data) {
  require(!data.nodes.empty() && data.nodes.size() % 2 == 1, "the number of nodes");
  std::vector<bool> has_parent(data.nodes.size(), false);
  has_parent[0] = true;
  for (std::size_t i = 0; i < data.nodes.size(); ++i) {
    check_node(data, static_cast<Eigen::Index>(i));
    if (data.nodes[i].fate != Fate::inner) continue;
    require(!has_parent[data.nodes[i].left], "a node with two parents");
    has_parent[data.nodes[i].left] = has_parent[data.nodes[i].right] = true;
  }
  require(std::ranges::find(has_parent, false) == has_parent.end(), "a node without a parent");
  const Fate expected = data.step == Step::grow ? Fate::open : Fate::branch;
  for (std::size_t k = 0; k < data.asked.size(); ++k) {
    const Eigen::Index node = data.asked[k];
    require(node >= 0 && node < std::ssize(data.nodes) && (k == 0 || data.asked[k - 1] < node) &&
                data.nodes[node].fate == expected,
            "a node that is asked for");
  }
  require((data.step >= Step::blend) == data.asked.empty(), "the list of nodes that are asked for");
  require(data.step != Step::blend || !data.sample_model.empty(), "the tree of the sample");
}

// The models of the pass that fits the tree of the sample.
void check_sample(const StateData& data) {
  const Model& sample = *data.sample;
  const auto is_product = [](const Regressor& each) { return each.second_input >= 0; };
  const auto is_of_inputs = [&](const Model& model) {
    return data.inputs() == std::ssize(model.inputs()) && model.outputs().size() == 1 && model.partitions().size() == 1;
  };
  require(is_of_inputs(sample) && is_of_inputs(*data.result) && unknowns_of(data) <= most_unknowns &&
              std::ranges::none_of(sample.regressors(), is_product),
          "the tree of the sample");
}

void check_option(Eigen::Index value, Eigen::Index last) { require(value >= 0 && value <= last, "an option"); }

}  // namespace

void check_state(const StateData& data) {
  const KeptOptions& options = data.options;
  require(options.sample_rows > 0 && options.branch_rows >= options.sample_rows && options.block_rows > 0, "an option");
  require(branch_options(options, 0).folds.count >= 0, "an option");
  check_option(options.weighted, 1);
  check_option(options.may_have_codes, 1);
  const Eigen::Index inputs = data.inputs();
  require(inputs > 0 && std::ssize(data.levels) == inputs, "the number of inputs");
  for (const std::vector<Text>& levels : data.levels) require(levels.size() <= most_levels, "the number of levels");
  require(data.step >= Step::describe && data.step <= Step::finished, "the next step");
  if (data.step == Step::describe) return require(data.nodes.empty() && data.rows == 0, "a node before the first pass");
  require(data.rows > 0 && data.blocks > 0 && std::isfinite(data.weight) && data.weight > 0.0 &&
              std::isfinite(data.weight_scale) && data.weight_scale > 0.0,
          "the number of rows");
  require(std::ssize(data.range) == inputs + 1 && data.mean.size() == inputs + 1 && data.scale.size() == inputs + 1 &&
              std::ssize(data.edges) == inputs && finite(data.mean) && finite(data.scale) &&
              (data.scale.array() > 0.0).all(),
          "what is known of the columns");
  for (const std::vector<double>& edges : data.edges) {
    require(std::ssize(edges) < 256 && std::ranges::is_sorted(edges, std::less_equal<>()), "the edges of bins");
  }
  check_nodes(data);
  const bool has_root_sums = !data.nodes.front().gram.empty();
  require(data.level_weight.size() == (has_root_sums ? data.levels.size() : 0), "the weights of the levels");
  for (std::size_t j = 0; j < data.level_weight.size(); ++j) {
    require(data.level_weight[j].size() == data.levels[j].size() &&
                std::ranges::all_of(data.level_weight[j], [](double weight) { return std::isfinite(weight); }),
            "the weights of the levels");
  }
}

std::vector<Eigen::Index> StateData::numbers() const {
  std::vector<Eigen::Index> numbers;
  for (Eigen::Index j = 0; j < inputs(); ++j) {
    if (levels[j].empty()) numbers.push_back(j);
  }
  return numbers;
}

std::vector<Eigen::Index> first_bins(const StateData& data) {
  std::vector<Eigen::Index> first = {0};
  for (Eigen::Index j = 0; j < data.inputs(); ++j) first.push_back(first.back() + bins_of(data, j));
  return first;
}

Eigen::VectorXd model_of(const StateData& data, const TopNode& node, int& rank) {
  return node.base + solve(data.shape(), node.gram.data(), 0.0, rank);
}

Eigen::Index unknowns_of(const StateData& data) {
  return data.sample ? data.sample->partitions().front().num_leaves() * (1 + std::ssize(data.sample->regressors())) : 0;
}

std::string sealed(char kind, const std::string& content) {
  Header header{};
  format.copy(header.format, sizeof header.format);
  header.version = version;
  header.kind = static_cast<unsigned char>(kind);
  header.length = content.size();
  header.checksum = hash_of(content);
  return std::string(reinterpret_cast<const char*>(&header), sizeof header) + content;
}

std::string_view unsealed(char kind, std::string_view bytes, const std::string& name) {
  Header header{};
  const auto fail = [&](const std::string& reason) { throw std::runtime_error(fmt::format("{}: {}", name, reason)); };
  if (bytes.size() < sizeof header) fail(fmt::format("{} bytes, the header alone has {}", bytes.size(), sizeof header));
  std::memcpy(&header, bytes.data(), sizeof header);
  if (std::string_view(header.format, sizeof header.format) != format) fail("no state or sums of a fit");
  if (header.version != version) fail(fmt::format("version {}, this program reads {}", header.version, version));
  if (header.kind != static_cast<unsigned char>(kind)) {
    fail(kind == 's' ? "sums where a state is expected" : "a state where sums are expected");
  }
  bytes.remove_prefix(sizeof header);
  if (header.length != bytes.size()) {
    fail(fmt::format("{} bytes behind the header, which says {}", bytes.size(), header.length));
  }
  if (header.checksum != hash_of(bytes)) fail("the bytes have changed since they were written");
  return bytes;
}

State finish_state(StateData data) {
  data.mark = hash_of(llmt::to_bytes(data));
  if (data.step >= Step::blend && !data.result) {
    data.result = from_json_with_intervals(to_string(data.model), "the model of a state").model;
  }
  if (data.step == Step::blend && !data.sample) {
    data.sample = from_json(to_string(data.sample_model), "the sample's model of a state");
    check_sample(data);
  }
  return State(std::make_shared<const StateData>(std::move(data)));
}

State start(std::vector<std::string> input_names, std::string output_name, const Options& options) {
  StateData data;
  data.options = kept_options(options);
  if (input_names.empty()) throw std::invalid_argument("llmt::distributed::start: there is no input");
  std::set<std::string> seen;
  for (const std::string& name : input_names) {
    if (name == output_name || !seen.insert(name).second) {
      throw std::invalid_argument(fmt::format("llmt::distributed::start: two columns have the name \"{}\"", name));
    }
    data.input_names.push_back(to_text(name));
  }
  data.output_name = to_text(output_name);
  data.levels = kept_levels(options.levels, data.input_names);
  return finish_state(std::move(data));
}

}  // namespace llmt::distributed

namespace llmt {

template <>
std::span<const Choice<distributed::Step>> choices() {
  using distributed::Step;
  static constexpr Choice<Step> steps[] = {{Step::describe, "describe"},
                                           {Step::grow, "grow"},
                                           {Step::gather, "gather"},
                                           {Step::blend, "blend"},
                                           {Step::finished, "finished"}};
  return steps;
}

}  // namespace llmt

namespace llmt::distributed {

Step State::step() const { return data_->step; }

namespace {

// Of top and branches, all of which are done; NaN: not all have held out rows.
double held_out_rmse(const StateData& data) {
  double squares = 0.0;
  for (const TopNode& node : data.nodes) {
    if (node.fate != Fate::inner) squares += node.weight * node.held_out_rmse * node.held_out_rmse;
  }
  return std::sqrt(squares / data.weight);
}

}  // namespace

Counts State::counts() const {
  Counts counts{.passes = data_->passes, .rows = data_->rows};
  for (const TopNode& node : data_->nodes) {
    if (node.fate == Fate::inner) continue;
    ++counts.top_leaves;
    counts.branches += node.fate == Fate::branch || node.fate == Fate::done ? 1 : 0;
    counts.branches_done += node.fate == Fate::done ? 1 : 0;
  }
  if (data_->step == Step::gather) {
    for (const Eigen::Index node : data_->asked) counts.rows_to_come += data_->nodes[node].rows;
  }
  if (data_->is_blended != 0) {
    counts.is_of_sample = true;
    counts.held_out_rmse = data_->sample_rmse;
    return counts;
  }
  counts.held_out_rmse = finished() ? llmt::distributed::held_out_rmse(*data_) : std::nan("");
  return counts;
}

std::vector<std::vector<std::string>> State::levels() const {
  std::vector<std::vector<std::string>> levels;
  for (const std::vector<Text>& of_input : data_->levels) levels.push_back(to_strings(of_input));
  return levels;
}

const Model& State::model() const {
  if (!finished()) throw std::invalid_argument("llmt::distributed::State::model: the fit is not finished");
  return *data_->result;
}

std::string State::model_json() const {
  if (!finished()) throw std::invalid_argument("llmt::distributed::State::model_json: the fit is not finished");
  return to_string(data_->model);
}

bool State::continues(const State& first) const {
  const StateData& other = first.data();
  return data_->input_names == other.input_names && data_->output_name == other.output_name &&
         data_->levels == other.levels && llmt::to_bytes(data_->options) == llmt::to_bytes(other.options);
}

std::string State::to_bytes() const { return sealed('s', llmt::to_bytes(*data_)); }

State State::from_bytes(std::string_view bytes, const std::string& name) {
  const std::string_view content = unsealed('s', bytes, name);
  try {
    StateData data = llmt::from_bytes<StateData>(content);
    check_state(data);
    return finish_state(std::move(data));
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {  // an option out of range is the file's, not an argument of the caller
    throw std::runtime_error(fmt::format("{}: {}", name, error.what()));
  }
}

}  // namespace llmt::distributed
