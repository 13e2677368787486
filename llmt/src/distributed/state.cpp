#include "distributed/state.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <stdexcept>

#include "llmt/intervals.hpp"

namespace llmt::distributed {
namespace {

constexpr std::string_view format = "LLMTSUMS";
constexpr std::uint32_t version = 1;

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
  require(node.fate >= Fate::open && node.fate <= Fate::done, "what becomes of a node");
  require(node.rows >= 0 && node.rows <= data.rows, "the number of rows of a node");
  require(node.base.size() == inputs + 1 && finite(node.base), "the model of a node");
  const bool known = node.fate == Fate::inner || node.fate == Fate::leaf;
  require(!known || (std::ssize(node.gram) == size && std::ssize(node.held_out) == size && node.low.size() == inputs &&
                     node.high.size() == inputs && finite(node.low) && finite(node.high)),
          "the sums of a node");
  if (node.fate != Fate::inner) return;
  const Eigen::Index nodes = std::ssize(data.nodes);
  require(node.left > at && node.right == node.left + 1 && node.right < nodes && node.left % 2 == 1,
          "a child of a node");
  require(node.input >= 0 && node.input < inputs && std::isfinite(node.threshold), "the split of a node");
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
  require((data.step == Step::finished) == data.asked.empty(), "the list of nodes that are asked for");
}

void check_option(Eigen::Index value, Eigen::Index last) { require(value >= 0 && value <= last, "an option"); }

}  // namespace

void check_state(const StateData& data) {
  const KeptOptions& options = data.options;
  require(options.branch_rows > 0 && options.block_rows > 0, "an option");
  check_option(options.pruning, static_cast<Eigen::Index>(Pruning::weakest_link));
  check_option(options.validity, static_cast<Eigen::Index>(ValidityChoice::blend));
  check_option(options.sparse, static_cast<Eigen::Index>(SparseChoice::always));
  check_option(options.estimation, static_cast<Eigen::Index>(Estimation::joint));
  check_option(options.folds, std::numeric_limits<int>::max());
  check_option(options.fold_kind, static_cast<Eigen::Index>(FoldKind::contiguous));
  check_option(options.intervals, 1);
  const Eigen::Index inputs = data.inputs();
  require(inputs > 0, "the number of inputs");
  require(data.step >= Step::describe && data.step <= Step::finished, "the next step");
  if (data.step == Step::describe) return require(data.nodes.empty() && data.rows == 0, "a node before the first pass");
  require(data.rows > 0 && data.blocks > 0 && data.blocks <= data.rows, "the number of rows");
  require(std::ssize(data.range) == inputs + 1 && data.mean.size() == inputs + 1 && data.scale.size() == inputs + 1 &&
              std::ssize(data.edges) == inputs && finite(data.mean) && finite(data.scale) &&
              (data.scale.array() > 0.0).all(),
          "what is known of the columns");
  for (const std::vector<double>& edges : data.edges) {
    require(std::ssize(edges) < 256 && std::ranges::is_sorted(edges, std::less_equal<>()), "the edges of bins");
  }
  check_nodes(data);
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

FitOptions branch_options(const KeptOptions& kept, int max_threads) {
  FitOptions options;
  options.max_leaves = kept.max_leaves;
  options.min_leaf_samples = kept.min_leaf_samples;
  options.significance = kept.significance;
  options.pruning = static_cast<Pruning>(kept.pruning);
  options.validity = static_cast<ValidityChoice>(kept.validity);
  options.sparse = static_cast<SparseChoice>(kept.sparse);
  options.folds = {static_cast<int>(kept.folds), static_cast<FoldKind>(kept.fold_kind), kept.seed};
  options.intervals = kept.intervals != 0;
  options.max_threads = max_threads;
  options.expert.estimation = static_cast<Estimation>(kept.estimation);
  options.expert.widths = kept.widths;
  options.expert.jumps = kept.jumps;
  options.expert.ridges = kept.ridges;
  options.expert.shrinkages = kept.shrinkages;
  return options;
}

KeptOptions kept_options(const Options& options) {
  const FitOptions& fit = options.fit;
  const auto refuse = [](bool asked, const char* option, const char* instead) {
    if (asked) {
      throw std::invalid_argument(
          fmt::format("llmt::distributed::start: {} is not possible beyond one memory; {}", option, instead));
    }
  };
  if (options.branch_rows < 100) {
    throw std::invalid_argument(
        fmt::format("llmt::distributed::start: branch_rows is {}, it must be at least 100", options.branch_rows));
  }
  if (options.block_rows < 1) {
    throw std::invalid_argument(
        fmt::format("llmt::distributed::start: block_rows is {}, it must be at least 1", options.block_rows));
  }
  refuse(fit.rule != GrowthRule::rd, "the growth rule", "take rd, or fit a sample that fits into memory");
  refuse(fit.expert.search == SplitSearch::exact, "exact search", "the top of the tree is searched by bins");
  refuse(fit.terms != LocalTerms::linear, "a quadratic local model", "take linear ones, or products as columns");
  refuse(fit.loss != Loss::squared, "Tukey's loss", "take the squared loss; medians over all rows are no sums");
  refuse(fit.validity == ValidityChoice::gaussian, "validity gaussian", "take crisp, blend or automatic");
  refuse(std::ranges::any_of(fit.trends, [](Trend trend) { return trend != Trend::any; }), "a trend",
         "fit a sample that fits into memory");
  refuse(!fit.split_inputs.empty(), "a list of split_inputs", "leave columns out of the table");
  refuse(!fit.regression_inputs.empty(), "a list of regression_inputs", "leave columns out of the table");
  KeptOptions kept;
  kept.branch_rows = options.branch_rows;
  kept.block_rows = options.block_rows;
  kept.max_leaves = fit.max_leaves;
  kept.min_leaf_samples = fit.min_leaf_samples;
  kept.significance = fit.significance;
  kept.pruning = static_cast<Eigen::Index>(fit.pruning);
  kept.validity = static_cast<Eigen::Index>(fit.validity);
  kept.sparse = static_cast<Eigen::Index>(fit.sparse);
  kept.estimation = static_cast<Eigen::Index>(fit.expert.estimation);
  kept.folds = fit.folds.count;
  kept.fold_kind = static_cast<Eigen::Index>(fit.folds.kind);
  kept.seed = fit.folds.seed;
  kept.intervals = fit.intervals ? 1 : 0;
  kept.widths = fit.expert.widths;
  kept.jumps = fit.expert.jumps;
  kept.ridges = fit.expert.ridges;
  kept.shrinkages = fit.expert.shrinkages;
  return kept;
}

State finish_state(StateData data) {
  data.mark = hash_of(llmt::to_bytes(data));
  if (data.step == Step::finished && !data.result) {
    data.result = from_json_with_intervals(to_string(data.model), "the model of a state").model;
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
  return finish_state(std::move(data));
}

Step State::step() const { return data_->step; }

Counts State::counts() const {
  Counts counts{.passes = data_->passes, .rows = data_->rows};
  double squares = 0.0;
  for (const TopNode& node : data_->nodes) {
    if (node.fate == Fate::inner) continue;
    ++counts.top_leaves;
    counts.branches += node.fate == Fate::branch || node.fate == Fate::done ? 1 : 0;
    counts.branches_done += node.fate == Fate::done ? 1 : 0;
    squares += static_cast<double>(node.rows) * node.held_out_rmse * node.held_out_rmse;
  }
  if (data_->step == Step::gather) {
    for (const Eigen::Index node : data_->asked) counts.rows_to_come += data_->nodes[node].rows;
  }
  counts.held_out_rmse = finished() ? std::sqrt(squares / static_cast<double>(data_->rows)) : std::nan("");
  return counts;
}

const Model& State::model() const {
  if (!data_->result) throw std::invalid_argument("llmt::distributed::State::model: the fit is not finished");
  return *data_->result;
}

std::string State::model_json() const {
  if (!data_->result) throw std::invalid_argument("llmt::distributed::State::model_json: the fit is not finished");
  return to_string(data_->model);
}

bool State::continues(const State& first) const {
  const StateData& other = first.data();
  return data_->input_names == other.input_names && data_->output_name == other.output_name &&
         llmt::to_bytes(data_->options) == llmt::to_bytes(other.options);
}

std::string State::to_bytes() const { return sealed('s', llmt::to_bytes(*data_)); }

State State::from_bytes(std::string_view bytes, const std::string& name) {
  const std::string_view content = unsealed('s', bytes, name);
  try {
    StateData data = llmt::from_bytes<StateData>(content);
    check_state(data);
    return finish_state(std::move(data));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", name, error.what()));
  }
}

}  // namespace llmt::distributed
