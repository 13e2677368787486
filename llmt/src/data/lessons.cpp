#include "data/lessons.hpp"

#include <map>
#include <numeric>
#include <utility>

namespace llmt {

// Lessons and the tables of their columns, one a lesson.
struct TaughtTables {
  std::shared_ptr<const Lessons> lessons;
  std::map<const Lesson*, Table> tables;
};

namespace {

Table table_of(const Lesson& lesson, const Table& measured) {
  return {.inputs = lesson.inputs,
          .outputs = lesson.outputs,
          .weights = lesson.weights,
          .num_levels = measured.num_levels,
          .regression_inputs = measured.regression_inputs,
          .split_inputs = measured.split_inputs,
          .products = measured.products,
          .slope_signs = measured.slope_signs,
          .monotone = measured.monotone};
}

// The rows of a lesson. What a model says of its outputs is what was measured.
TrainingRows rows_of(const Table& lesson, const TrainingRows& measured, int max_threads) {
  std::vector<int> rows(lesson.inputs.rows());
  std::iota(rows.begin(), rows.end(), 0);
  TrainingRows result = training_rows(lesson, std::move(rows), max_threads);
  result.output_columns = measured.output_columns;
  return result;
}

}  // namespace

Training taught(Training training, std::shared_ptr<const Lessons> lessons) {
  const auto tables = std::make_shared<TaughtTables>();
  tables->lessons = std::move(lessons);
  const int threads = training.options.max_threads;
  const auto table = [&](const Lesson& lesson) -> const Table& {
    return tables->tables.try_emplace(&lesson, table_of(lesson, *training.weighted)).first->second;
  };
  training.all = rows_of(table(*tables->lessons->of_all), training.all, threads);
  std::vector<int> measured = std::move(training.measured.rows);
  training.measured = training.all;
  training.measured.rows = std::move(measured);
  training.measured = with_table(training.measured, *training.table);
  for (std::size_t f = 0; f < training.folds.size(); ++f) {
    FoldRows& fold = training.folds[f];
    fold.training = rows_of(table(*tables->lessons->of_folds[f]), fold.training, threads);
    fold.held_out = query_rows(*training.table, fold.held_out.rows, fold.training);
  }
  training.taught = tables;
  return training;
}

std::shared_ptr<const Lessons> lessons_of(const Training& training) {
  return training.taught == nullptr ? nullptr : training.taught->lessons;
}

}  // namespace llmt
