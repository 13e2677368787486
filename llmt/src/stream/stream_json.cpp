// The state of a stream as JSON text, and back: docs/file-formats.md.
#include <memory>
#include <stdexcept>

#include "llmt/options.hpp"
#include "llmt/stream.hpp"
#include "model_files/model_json.hpp"
#include "stream/state.hpp"
#include "stream/stream_archive.hpp"
#include "stream/stream_links.hpp"

namespace llmt {

namespace {

constexpr const char* stream_format_name = "llmt-stream";
constexpr int stream_format_version = 1;

// A row as Stream::add() accepts it, of positive weight.
bool is_row(const std::vector<double>& row, Eigen::Index inputs) {
  for (Eigen::Index k = 0; k < std::ssize(row); ++k) {
    const bool is_missing = k < inputs && std::isnan(row[k]);
    if (!is_missing && !(std::abs(row[k]) <= largest_magnitude)) return false;
  }
  return row.back() > 0.0;
}

}  // namespace

/// The fields of each part, for both directions.
struct StreamJson {
  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, StreamOptions>& options) {
    for_each_field(options, [&](const char* name, auto& value) {
      if constexpr (std::is_floating_point_v<std::remove_cvref_t<decltype(value)>>) {
        archive.number(name, value);
      } else {  // the defaults are filled in; Stream() checks the bounds
        archive.count(name, value, std::string_view(name) == "reservoir_rows" ? 0 : 1);
      }
    });
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, RiseDetector>& rise) {
    archive.number("usual", rise.usual_);
    archive.number("excess", rise.excess_);
    archive.count("rows", rise.rows_, 0);
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, Duel>& duel) {
    archive.number("weight", duel.weight_);
    archive.number("mean", duel.mean_);
    archive.number("square", duel.square_);
    archive.count("rows", duel.rows_, 0);
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, ThresholdWatch>& watch) {
    archive.number("threshold", watch.threshold_);
    archive.number("reach", watch.reach_);
    archive.count("rows", watch.rows_, 0);
    archive.numbers("sums", watch.sums_, std::ssize(watch.sums_));
    archive.numbers("squares", watch.squares_, std::ssize(watch.squares_));
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, Sums>& sums, const StreamSetting& setting) {
    archive.count("rows", sums.rows, 0);
    archive.grams("gram", sums.gram, setting.shape, 1);
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, LeafSearch>& search, const StreamSetting& setting) {
    archive.count("rows", search.rows_, 0);
    archive.count("next_test", search.next_test_, 0);
    archive.count("first_passed", search.first_passed_, 0);
    archive.count("tests", search.tests_, 0, 1'000'000);
    archive.number("different", search.different_);
    archive.flag("laid_out", search.laid_out_);
    if (search.laid_out_) {
      archive.parts("bins", setting.inputs, [&](auto& inner, Eigen::Index j) {
        auto& bins = search.bins_[j];
        inner.list("edges", bins.edges, setting.bins - 1);
        const Eigen::Index count = std::ssize(bins.edges) + 1;
        inner.counts("rows", bins.rows, count);
        inner.grams("grams", bins.grams, setting.shape, count);
      });
      return;
    }
    const Eigen::Index most = LeafSearch::rows_before_bins - 1;
    archive.list("first_rows", search.first_rows_, most * (setting.inputs + 2));
    if constexpr (Archive::reads) {
      if (std::ssize(search.first_rows_) != search.rows_ * (setting.inputs + 2)) {
        archive.json().fail(fmt::format("{} rows of first_rows are needed", search.rows_));
      }
    }
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, StreamNode>& node, InArchive<Archive, StreamLinks>& links,
                     const StreamSetting& setting) {
    const Eigen::Index inputs = setting.inputs;
    archive.numbers("origin", node.basis.origin, inputs);
    archive.numbers("base", node.basis.base, inputs + 1);
    archive.numbers("model", node.model, inputs + 1);
    archive.count("solved_at", node.solved_at, 0);
    archive.numbers("low", node.low, inputs);
    archive.numbers("high", node.high, inputs);
    archive.part("sums", [&](auto& inner) { fields(inner, node.sums, setting); });
    archive.part("rise", [&](auto& inner) { fields(inner, node.rise); });
    archive.optional_part("search", node.search != nullptr, [&](auto& inner) {
      if constexpr (Archive::reads) node.search = std::make_unique<LeafSearch>(setting);
      fields(inner, *node.search, setting);
    });
    archive.optional_part("split", links.left >= 0, [&](auto& inner) {
      inner.count("input", node.input, 0, inputs - 1);
      inner.number("threshold", node.threshold);
      inner.number("gain", node.gain);
      inner.count("epoch", node.epoch, 1);
      inner.part("watch", [&](auto& watch) { fields(watch, node.watch); });
      inner.part("left_sums", [&](auto& sums) { fields(sums, node.sides[0], setting); });
      inner.part("right_sums", [&](auto& sums) { fields(sums, node.sides[1], setting); });
      inner.count("left", links.left, 1);
      inner.count("right", links.right, 1);
    });
    archive.optional_part("alternate", links.alternate >= 0, [&](auto& inner) {
      inner.count("node", links.alternate, 1);
      inner.part("duel", [&](auto& duel) { fields(duel, node.duel); });
    });
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, StreamSetting>& setting) {
    archive.number("output_variance", setting.output_variance);
    archive.number("rounding", setting.rounding);
    archive.numbers("centre", setting.centre, setting.inputs);
    archive.numbers("scale", setting.scale, setting.inputs);
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, StreamTree::Counts>& counts) {
    archive.count("splits", counts.splits, 0);
    archive.count("prunes", counts.prunes, 0);
    archive.count("drifts", counts.drifts, 0);
    archive.count("replacements", counts.replacements, 0);
  }

  template <class Archive>
  static void fields(Archive& archive, InArchive<Archive, StreamState>& state) {
    archive.count("offered", state.offered_, 0);
    archive.count("rows", state.rows_, 0);
    archive.count("tested", state.tested_, 0);
    archive.count("missing", state.missing_, 0);
    archive.parts("columns", state.inputs_ + state.outputs_, [&](auto& inner, Eigen::Index k) {
      auto& column = state.columns_[k];
      inner.number("known", state.known_(k));
      inner.number("low", column.low);
      inner.number("high", column.high);
      inner.number("mean", column.mean);
    });
    archive.numbers("squares", state.squares_, state.outputs_);
    archive.numbers("recent", state.recent_, state.outputs_);
  }

  static void write_rows(StreamWriter& archive, const StreamState& state) {
    std::vector<const Reservoir::Row*> kept;
    for (const auto& [hash, row] : state.reservoir_.rows()) kept.push_back(&row);
    archive.parts("reservoir", std::ssize(kept), [&](StreamWriter& inner, Eigen::Index k) {
      inner.count("times", kept[k]->times, 1);
      inner.numbers("values", kept[k]->values, state.width());
    });
    archive.list("first_rows", state.first_rows_, 0);
  }

  static void read_rows(StreamReader& archive, StreamState& state) {
    const JsonReader& json = archive.json();
    const JsonReader reservoir = json.member("reservoir");
    if (reservoir.size() > state.options_.reservoir_rows) reservoir.fail("it has more rows than reservoir_rows says");
    archive.parts("reservoir", reservoir.size(), [&](StreamReader& inner, Eigen::Index) {
      std::vector<double> values;
      Eigen::Index times = 0;
      inner.count("times", times, 1);
      inner.numbers("values", values, state.width());
      if (!is_row(values, state.inputs_)) inner.json().fail("a value or the weight is not one that a stream takes");
      const std::size_t before = state.reservoir_.rows().size();
      state.reservoir_.add(values.data(), times);
      if (state.reservoir_.rows().size() == before) inner.json().fail("the row stands there twice");
    });
    const Eigen::Index width = state.width();
    const JsonReader first = json.member("first_rows");
    archive.list("first_rows", state.first_rows_, state.rows_before_trees() * width);
    for (Eigen::Index i = 0; i < std::ssize(state.first_rows_) / width; ++i) {
      const auto begin = state.first_rows_.begin() + i * width;
      if (!is_row({begin, begin + width}, state.inputs_))
        first.fail(fmt::format("row {} is not one that a stream takes", i));
    }
  }

  static void write_trees(StreamWriter& archive, const StreamState& state) {
    archive.parts("trees", std::ssize(state.trees_), [&](StreamWriter& inner, Eigen::Index o) {
      const StreamTree& tree = *state.trees_[o];
      fields(inner, tree.setting_);
      fields(inner, tree.counts_);
      const std::vector<const StreamNode*> nodes = nodes_of(tree.root());
      const std::vector<StreamLinks> links = links_of(nodes);
      inner.parts("nodes", std::ssize(nodes),
                  [&](StreamWriter& node, Eigen::Index k) { fields(node, *nodes[k], links[k], tree.setting_); });
    });
  }

  static void read_trees(StreamReader& archive, StreamState& state) {
    const JsonReader list = archive.json().member("trees");
    // Trees start when there are enough rows.
    const bool has_started = state.rows_ >= state.rows_before_trees();
    const Eigen::Index first_rows = has_started ? 0 : state.rows_;
    if (std::ssize(state.first_rows_) != first_rows * state.width()) {
      archive.json().member("first_rows").fail(fmt::format("{} rows are needed", first_rows));
    }
    archive.parts("trees", has_started ? state.outputs_ : 0, [&](StreamReader& inner, Eigen::Index) {
      StreamSetting setting = state.usual_setting();
      fields(inner, setting);
      if (!(setting.scale.array() > 0.0).all()) inner.json().fail("a scale is not positive");
      StreamTree& tree = state.add_tree(setting, Eigen::VectorXd::Zero(setting.coefficients()));
      fields(inner, tree.counts_);
      std::vector<std::unique_ptr<StreamNode>> nodes;
      std::vector<StreamLinks> links;
      const JsonReader json = inner.json().member("nodes");
      inner.parts("nodes", json.size(), [&](StreamReader& node, Eigen::Index) {
        nodes.push_back(std::make_unique<StreamNode>());
        fields(node, *nodes.back(), links.emplace_back(), tree.setting_);
      });
      if (nodes.empty()) json.fail("there is no node");
      tree.root_ = joined(std::move(nodes), links, json);
      tree.recount();
    });
  }

  static std::string text_of(const StreamState& state) {
    Json json;
    StreamWriter archive(json);
    json["format"] = stream_format_name;
    json["version"] = stream_format_version;
    archive.count("inputs", state.inputs_, 1);
    archive.count("outputs", state.outputs_, 1);
    archive.part("options", [&](auto& inner) { fields(inner, state.options_); });
    fields(archive, state);
    write_rows(archive, state);
    write_trees(archive, state);
    return json.dump() + "\n";
  }

  static void read(StreamReader& archive, StreamState& state) {
    fields(archive, state);
    read_rows(archive, state);
    read_trees(archive, state);
  }
};

std::string to_json(const Stream& stream) { return StreamJson::text_of(*stream.state_); }

Stream stream_from_json(const std::string& text, const std::string& name) {
  const JsonDocument document = parse_json(text, name);
  const Json& json = document.value();
  const JsonReader root(json, name);
  if (!root.has("format") || root.member("format").as<std::string>() != stream_format_name) {
    root.fail(fmt::format("not a stream: \"format\" is not \"{}\"", stream_format_name));
  }
  StreamReader archive(root);
  int version = 0;
  archive.count("version", version, stream_format_version, stream_format_version);
  // Every column has its element, so a short text cannot ask for much memory.
  const Eigen::Index columns = root.member("columns").size();
  Eigen::Index inputs = 0;
  Eigen::Index outputs = 0;
  archive.count("inputs", inputs, 1, columns);
  archive.count("outputs", outputs, 1, columns);
  StreamOptions options;
  archive.part("options", [&](auto& inner) { StreamJson::fields(inner, options); });
  Stream stream = [&] {
    try {
      return Stream(inputs, outputs, options);
    } catch (const std::invalid_argument& error) {
      root.member("options").fail(error.what());
    }
  }();
  StreamJson::read(archive, *stream.state_);
  return stream;
}

}  // namespace llmt
