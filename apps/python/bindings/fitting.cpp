#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "llmt/fit.hpp"
#include "llmt/outliers.hpp"
#include "llmt/readable.hpp"
#include "llmt/stream.hpp"
#include "llmt/teach.hpp"
#include "llmt/time_limit.hpp"
#include "python/bindings/arrays.hpp"
#include "python/bindings/interruptible.hpp"
#include "python/bindings/module.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/rows.hpp"
#include "report/document/document_text.hpp"
#include "report/document/page.hpp"
#include "report/fit/fit_accuracy.hpp"
#include "report/fit/fit_summary.hpp"
#include "report/fit/gross_errors.hpp"
#include "report/fit/of_fit.hpp"
#include "report/fit/readable_summary.hpp"
#include "report/fit/teaching_summary.hpp"
#include "report/fit/time_limit.hpp"
#include "report/table/named_inputs.hpp"

namespace llmt::python {
namespace {

constexpr double preparing_share = 0.05;
constexpr double readable_share = 0.4;

// A fit with all that reports need of it.
class Fit {
 public:
  Fit(TrainingData data, const FitOptions& options, std::optional<double> readable_loss, Eigen::Index readable_rules,
      bool teach, double time_limit, const nb::object& report)
      : options_(options), asked_{readable_loss.value_or(ReadableOptions().loss), readable_rules} {
    if (const std::string why = teach ? why_not_taught(options) : ""; !why.empty()) {
      throw std::invalid_argument("teaching does not go with " + why);
    }
    if (const std::string why = readable_loss ? why_not_readable(options) : ""; !why.empty()) {
      throw std::invalid_argument("a readable tree does not go with " + why);
    }
    if (teach && time_limit > 0.0) throw std::invalid_argument("teaching does not go with a time limit");
    lines_.resize(data.inputs.rows());
    std::iota(lines_.begin(), lines_.end(), Eigen::Index{0});
    const auto shared = std::make_shared<const TrainingData>(std::move(data));
    interruptible(
        [&](const Progress& progress) {
          Work work(progress);
          Work fitting(work, work.left() - (readable_loss ? readable_share : 0.0));
          fit_model(shared, teach, time_limit, fitting);
          if (!readable_loss) return;
          Work reading(work, work.left());
          readable_ = fit_readable(*prepared_, result_->summary, asked_, reading.progress());
        },
        report);
  }

  std::string model() const { return to_json(result_->model, result_->intervals); }
  std::optional<std::string> readable() const {
    return readable_ ? std::optional(to_json(readable_->model, readable_->intervals)) : std::nullopt;
  }

  std::string summary(const std::string& data) const {
    report::Json summary = report::fit_json(run(data), *result_);
    if (time_) summary["time_limit"] = report::time_limit_json(*time_, report::LimitedSize::leaves);
    if (taught_) summary["teaching"] = report::teaching_json(*taught_);
    if (readable_) summary["readable"] = report::readable_json(*result_, *readable_, asked_);
    return summary.dump();
  }

  std::string text(const std::string& data, std::size_t width) const {
    constexpr std::size_t indent = 2;
    return report::wrapped(report::document_text(words(data), width), width, indent);
  }

  std::vector<std::vector<Eigen::Index>> held_out() const { return result_->summary.held_out; }
  std::vector<double> loss_weights() const {
    return {result_->summary.loss_weights.begin(), result_->summary.loss_weights.end()};
  }

  // Observed and predicted values of an output on held-out rows; empty without folds.
  std::tuple<std::vector<double>, std::vector<double>> held_out_predictions(Eigen::Index output) const {
    if (result_->intervals.empty()) return {};
    const TrainingData& rows = prepared_->data();
    const report::HeldOutRows found =
        report::held_out({"", rows.inputs, rows.outputs, options_, *result_, readable_, 0}, output);
    return {found.observed, found.predicted};
  }

  // Rows of an output that are likely mistakes: positions, share of the squared error, held-out rows.
  std::tuple<std::vector<Eigen::Index>, double, Eigen::Index> gross_errors(Eigen::Index output) const {
    const report::GrossErrors found = report::gross_errors(prepared_->data(), *result_, output, options_.max_threads);
    return {found.rows, found.share, found.held_out};
  }

  // The page of `llmt fit --report`; empty where the module was built without it.
  std::string page(const std::string& data, const std::string& origin) const {
    if (report::empty_page().empty()) return "";
    const bool has_folds = result_->summary.partitions.front().cv_folds > 0;
    std::optional<ReadableResult> shown = readable_;
    if (!shown && has_folds && why_not_readable(options_).empty()) {
      interruptible(
          [&](const Progress& progress) { shown = fit_readable(*prepared_, result_->summary, asked_, progress); },
          nb::none());
    }
    const TrainingData& rows = prepared_->data();
    return report::filled_page(
        report::empty_page(),
        report::fit_report({data, rows.inputs, rows.outputs, options_, *result_, shown, 0}, words(data)), origin);
  }

 private:
  void fit_model(const std::shared_ptr<const TrainingData>& data, bool teach, double time_limit, Work& work) {
    if (time_limit > 0.0) {
      TimedTree timed = fit_within(time_limit, data, options_, work.progress());
      options_ = std::move(timed.options);
      prepared_ = std::move(timed.prepared);
      result_ = std::move(timed.fit);
      time_ = timed.time;
      return;
    }
    Work preparing(work, preparing_share);
    prepared_.emplace(data, options_, preparing.progress());
    Work fitting(work, work.left());
    if (!teach) {
      result_.emplace(fit(*prepared_, fitting.progress()));
      return;
    }
    taught_ = fit_taught(*prepared_, {.seed = options_.folds.seed}, fitting.progress());
    prepared_ = taught_->prepared;
    result_ = taught_->fit;
  }

  report::FitRun run(const std::string& data) const { return {data, options_, prepared_->data(), lines_, ""}; }

  report::Document words(const std::string& data) const {
    report::Document words = report::fit_words(run(data), *result_);
    if (time_) words.notes.push_back(report::time_limit_text(*time_, report::LimitedSize::leaves));
    if (taught_) words.sections.push_back(report::teaching_words(*taught_));
    if (readable_) words.sections.push_back(report::readable_words(*result_, *readable_, asked_));
    return words;
  }

  FitOptions options_;
  ReadableOptions asked_;
  std::optional<PreparedFit> prepared_;
  std::optional<FitResult> result_;
  std::optional<TaughtResult> taught_;
  std::optional<ReadableResult> readable_;
  std::optional<TimeLimit> time_;
  std::vector<Eigen::Index> lines_;  // of the rows, counted from 0
};

std::unique_ptr<Fit> fit_table(const Array& inputs, const Array& outputs, const Options& options,
                               std::vector<std::string> input_names, std::vector<std::string> output_names,
                               std::vector<std::vector<std::string>> levels, const std::optional<Vector>& weights,
                               const std::optional<Vector>& groups, std::vector<Eigen::Index> held_out,
                               bool may_have_codes, std::optional<double> readable_loss, Eigen::Index readable_rules,
                               bool teach, double time_limit, const nb::object& report) {
  TrainingData data = training_data_of(inputs, outputs, weights, groups);
  data.held_out = std::move(held_out);
  data.levels = std::move(levels);
  data.may_have_codes = may_have_codes;
  data.input_names = std::move(input_names);
  data.output_names = std::move(output_names);
  return std::make_unique<Fit>(std::move(data), options_of(options), readable_loss, readable_rules, teach, time_limit,
                               report);
}

// Inputs that look as if nobody meant them: (kind, position, detail, whether it is left out).
std::vector<std::tuple<std::string, int, std::string, bool>> accidental(const Array& inputs,
                                                                        std::vector<std::vector<std::string>> levels) {
  using Why = report::AccidentalInput::Kind;
  report::InputColumns columns{.values = rows_of(inputs), .levels = std::move(levels), .categorical = {}};
  for (int j = 0; j < static_cast<int>(columns.levels.size()); ++j) {
    if (!columns.levels[j].empty()) columns.categorical.push_back(j);
  }
  std::vector<std::tuple<std::string, int, std::string, bool>> found;
  for (const report::AccidentalInput& input : report::accidental_inputs(columns)) {
    const char* kind = input.kind == Why::words       ? "words"
                       : input.kind == Why::dates     ? "dates"
                       : input.kind == Why::unit      ? "unit"
                       : input.kind == Why::far_value ? "far_value"
                                                      : "row_numbers";
    found.emplace_back(kind, input.input, input.detail, input.is_left_out);
  }
  return found;
}

std::tuple<std::vector<Eigen::Index>, double, bool> dominant(const Vector& output) {
  const DominantRows found = dominant_rows(vector_of(output));
  return {found.rows, found.share, found.hide_the_others};
}

// A stream that threads of the interpreter may share: one call after the other. Nobody waits for another thread with
// the interpreter's lock in hand, which that thread may need.
class SharedStream {
 public:
  explicit SharedStream(Stream stream) : stream_(std::move(stream)) {}

  template <class Work>
  auto use(const Work& work) {
    const nb::gil_scoped_release unlocked;
    const std::lock_guard lock(mutex_);
    return work(stream_);
  }

  // As if `other` were taken at this moment; it may be this one.
  void merge_with(SharedStream& other) {
    const std::string given = other.use([](const Stream& stream) { return to_json(stream); });
    // A merge that fails leaves the stream as it was.
    use([&](Stream& stream) { stream = merge(stream_from_json(to_json(stream)), stream_from_json(given)); });
  }

 private:
  std::mutex mutex_;
  Stream stream_;
};

void add_stream(nb::module_& module) {
  nb::class_<SharedStream>(module, "Stream", "A tree that learns from rows as they come.")
      .def("__init__",
           [](SharedStream* self, Eigen::Index inputs, Eigen::Index outputs, const Options& options) {
             new (self) SharedStream(Stream(inputs, outputs, stream_options(options_of(options))));
           })
      .def_static("from_json",
                  [](const std::string& text) { return std::make_unique<SharedStream>(stream_from_json(text)); })
      .def("to_json", [](SharedStream& self) { return self.use([](const Stream& stream) { return to_json(stream); }); })
      .def(
          "add",
          [](SharedStream& self, const Array& inputs, const Array& outputs, const std::optional<Vector>& weights) {
            const Eigen::MatrixXd x = rows_of(inputs);
            const Eigen::MatrixXd y = rows_of(outputs);
            const Eigen::VectorXd w = weights ? vector_of(*weights) : Eigen::VectorXd();
            self.use([&](Stream& stream) { stream.add(x, y, w); });
          },
          nb::arg("inputs"), nb::arg("outputs"), nb::arg("weights") = nb::none())
      .def("merge", &SharedStream::merge_with)
      .def("rows", [](SharedStream& self) { return self.use([](const Stream& s) { return s.counts().rows; }); })
      .def("prequential_rmse",
           [](SharedStream& self) {
             const Eigen::VectorXd rmse = self.use([](const Stream& stream) { return stream.prequential_rmse(); });
             return std::vector<double>(rmse.begin(), rmse.end());
           })
      .def("model", [](SharedStream& self, const std::vector<std::string>& inputs,
                       const std::vector<std::string>& outputs, const std::string& validity) {
        return self.use([&](const Stream& stream) {
          return to_json(stream.snapshot(parse<ValidityChoice>(validity)).named(inputs, outputs));
        });
      });
}

}  // namespace

void add_fitting(nb::module_& module) {
  nb::class_<Fit>(module, "Fit", "A fit with all that reports need of it.")
      .def("model", &Fit::model)
      .def("readable", &Fit::readable)
      .def("summary", &Fit::summary, nb::arg("data"))
      .def("text", &Fit::text, nb::arg("data"), nb::arg("width"))
      .def("held_out", &Fit::held_out)
      .def("loss_weights", &Fit::loss_weights)
      .def("held_out_predictions", &Fit::held_out_predictions, nb::arg("output"))
      .def("gross_errors", &Fit::gross_errors, nb::arg("output"))
      .def("page", &Fit::page, nb::arg("data"), nb::arg("origin"));
  module.def("fit", &fit_table, nb::arg("inputs"), nb::arg("outputs"), nb::arg("options"), nb::kw_only(),
             nb::arg("input_names"), nb::arg("output_names"), nb::arg("levels"), nb::arg("weights") = nb::none(),
             nb::arg("groups") = nb::none(), nb::arg("held_out") = std::vector<Eigen::Index>(),
             nb::arg("may_have_codes") = true, nb::arg("readable_loss") = nb::none(), nb::arg("readable_rules") = 0,
             nb::arg("teach") = false, nb::arg("time_limit") = 0.0, nb::arg("report") = nb::none());
  module.def("accidental_inputs", &accidental, nb::arg("inputs"), nb::arg("levels"));
  module.def("dominant_rows", &dominant, nb::arg("output"));
  add_stream(module);
}

}  // namespace llmt::python
