#include "teach/learned.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "base/parallel.hpp"
#include "llmt/boosted.hpp"
#include "teach/made_rows.hpp"

namespace llmt {
namespace {

// Fewer groups fit_boosted() cannot hold a fifth of.
constexpr std::size_t fewest_groups = 5;

Teacher sum_of_trees(const TeachOptions& options, int max_threads) {
  return [=](const TrainingData& rows, const Progress& progress) -> Answers {
    const BoostOptions boost{.seed = options.seed, .max_threads = max_threads};
    const auto model = std::make_shared<const BoostedModel>(fit_boosted(rows, boost, progress).model);
    return [=](const Eigen::Ref<const Eigen::MatrixXd>& inputs) { return model->predict(inputs, max_threads); };
  };
}

// Kept rows have the sums of the weights of equal ones, the largest 1. Counts are whole again.
Eigen::VectorXd as_counts(const Eigen::VectorXd& weights) {
  const Eigen::VectorXd counts = weights / weights.minCoeff();
  const Eigen::VectorXd whole = counts.array().round();
  constexpr double rounding = 1e-9;
  return (counts - whole).cwiseAbs().maxCoeff() <= rounding * whole.maxCoeff() ? whole : weights;
}

class Lectures {
 public:
  Lectures(const Training& training, const TeachOptions& options)
      : training_(training),
        options_(options),
        threads_(training.options.max_threads),
        teacher_(options.teacher ? options.teacher : sum_of_trees(options, threads_)) {}

  // The lesson of some rows, and the answers for others.
  std::shared_ptr<const Lesson> teach(const TrainingRows& rows, const std::vector<int>& others,
                                      Eigen::MatrixXd* answers_for_others, Work& work) const {
    const Eigen::Ref<const Eigen::MatrixXd>& inputs = training_.table->inputs;
    const TrainingData data = data_of(rows);
    const Answers answers = teacher_(data, work.progress());
    const MadeRows made = make_rows(data.inputs, training_.categorical, options_, threads_);
    auto lesson = std::make_shared<Lesson>();
    const Eigen::Index own = rows.count();
    const Eigen::Index all = own + made.inputs.rows();
    lesson->inputs.resize(all, inputs.cols());
    lesson->inputs << data.inputs, made.inputs;
    lesson->outputs = checked(answers(lesson->inputs), all);
    lesson->weights.resize(all);
    for (Eigen::Index i = 0; i < all; ++i) {
      const Eigen::Index row = i < own ? i : made.made_of[i - own];
      lesson->weights(i) = rows.table->weights(rows.rows[row]);
    }
    if (answers_for_others != nullptr) {
      *answers_for_others = checked(answers(inputs(others, Eigen::all)), std::ssize(others));
    }
    work.finish();
    return lesson;
  }

 private:
  TrainingData data_of(const TrainingRows& rows) const {
    const Table& table = *training_.table;
    const KeptRows& kept = *training_.kept;
    TrainingData data;
    data.inputs = table.inputs(rows.rows, Eigen::all);
    data.outputs = table.outputs(rows.rows, Eigen::all);
    Eigen::VectorXd weights = as_counts(table.weights(rows.rows));
    if (kept.loss_weights.size() > 0) weights = weights.cwiseProduct(kept.loss_weights(rows.rows));
    if (!(weights.array() == 1.0).all()) data.weights = std::move(weights);
    data.categorical_inputs = training_.categorical;
    if (kept.groups.empty()) return data;
    for (const int row : rows.rows) data.groups.push_back(kept.groups[row]);
    if (std::set(data.groups.begin(), data.groups.end()).size() < fewest_groups) data.groups.clear();
    return data;
  }

  Eigen::MatrixXd checked(Eigen::MatrixXd answers, Eigen::Index rows) const {
    if (answers.rows() != rows || answers.cols() != training_.outputs()) {
      throw std::runtime_error(
          fmt::format("llmt::fit_taught: the teacher's answers are {} x {} for {} rows of {} outputs", answers.rows(),
                      answers.cols(), rows, training_.outputs()));
    }
    if (!answers.allFinite()) throw std::runtime_error("llmt::fit_taught: an answer of the teacher is not finite");
    return answers;
  }

  const Training& training_;
  const TeachOptions& options_;
  int threads_;
  Teacher teacher_;
};

}  // namespace

Taught teach(const Training& training, const TeachOptions& options, Work& work) {
  const Lectures lectures(training, options);
  const Eigen::Index folds = std::ssize(training.folds);
  // A fold that the caller holds out trains on the rows of the model.
  const bool has_own = !training.kept->is_fold_given;
  Taught taught;
  taught.lessons.of_folds.resize(folds);
  taught.held_out.resize(folds);
  const double share = work.left() / static_cast<double>(folds + (has_own ? 1 : 0));
  parallel_for(folds + (has_own ? 1 : 0), training.options.max_threads, [&](Eigen::Index k) {
    Work part(work, share);
    if (k == folds) {
      taught.lessons.of_all = lectures.teach(training.all, {}, nullptr, part);
      return;
    }
    const FoldRows& fold = training.folds[k];
    taught.lessons.of_folds[k] = lectures.teach(fold.training, fold.held_out.rows, &taught.held_out[k], part);
  });
  if (!has_own) taught.lessons.of_all = taught.lessons.of_folds.front();
  return taught;
}

}  // namespace llmt
