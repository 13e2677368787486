#include <fmt/format.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "llmt/robotics/catalogue.hpp"
#include "llmt/robotics/robot_c_source.hpp"
#include "python/bindings/interruptible.hpp"
#include "python/bindings/module.hpp"
#include "python/bindings/outcome.hpp"
#include "python/bindings/robots.hpp"
#include "report/document/document_text.hpp"
#include "report/document/page.hpp"
#include "report/robot/arm_tables.hpp"
#include "report/robot/calibration_document.hpp"
#include "report/robot/calibration_run.hpp"
#include "report/robot/check_run.hpp"
#include "report/robot/compensation_run.hpp"
#include "report/robot/controller_tables.hpp"
#include "report/robot/discovery/discovery_page.hpp"
#include "report/robot/discovery/discovery_run.hpp"
#include "report/robot/discovery/of_discovery.hpp"
#include "report/robot/measurement_text.hpp"
#include "report/robot/of_calibration.hpp"
#include "report/robot/pose_report.hpp"
#include "report/robot/provenance.hpp"

namespace llmt::python {
namespace {

std::vector<double> numbers_of(const Eigen::VectorXd& values) { return {values.begin(), values.end()}; }

void require_page(bool wanted) {
  if (!wanted || !report::empty_page().empty()) return;
  throw std::runtime_error("report: this package was built without the page of the reports");
}

// The HTML file of a document, or nothing where none is wanted.
nb::object page_of(bool wanted, const std::function<report::Document()>& document) {
  if (!wanted) return nb::none();
  const report::Document made = document();
  const std::string origin = fmt::format("{}. Made by LLMT {}.", made.title, LLMT_VERSION);
  return nb::cast(report::filled_page(report::empty_page(), made, origin));
}

// A robot that a task made of another one.
Arm arm_of(const Arm& arm, robotics::CorrectedRobot robot) {
  robot.robot.correction_file.clear();
  return {arm.name, std::move(robot), arm.urdf};
}

using ReadTest = std::function<robotics::Measurements(const robotics::Robot&)>;
ReadTest test_reader(const std::optional<Source>& test, const std::vector<std::string>& also, const Reading& reading) {
  if (!test) return {};
  return [&test, also, &reading](const robotics::Robot& robot) { return measurements_of(*test, robot, also, reading); };
}

nb::dict calibrate(const Arm& arm, const Source& measured, const std::optional<Source>& test, const Reading& reading,
                   const std::string& made_from, bool correct, bool boost, int folds, bool contiguous, bool new_session,
                   bool robust, const std::vector<std::string>& fixed, const std::vector<std::string>& only,
                   const std::map<std::string, double>& priors, int max_leaves, Eigen::Index min_leaf,
                   const std::string& accept_suspicion, double limit_mm, std::uint64_t seed, int threads, bool quality,
                   bool page, const nb::object& report) {
  require_page(page);
  report::CalibrationTask task{.robot_file = arm.name,
                               .data_file = measured.first,
                               .test_file = test ? test->first : "",
                               .robust = robust,
                               .quality = quality,
                               .page = page,
                               .new_session = new_session,
                               .accept_suspicion = accept_suspicion,
                               .limit_mm = limit_mm};
  task.options.correct = correct;
  task.options.boost = boost;
  task.options.folds = folds;
  task.options.kind = contiguous ? FoldKind::contiguous : FoldKind::random;
  task.options.calibration = {.fixed = fixed, .only = only, .priors = priors};
  task.options.correction = {.max_leaves = max_leaves, .min_leaf_samples = min_leaf};
  task.options.seed = seed;
  task.options.max_threads = threads;
  Outcome outcome(python_face(measured.second));
  task.face = outcome.face();
  std::optional<report::CalibrationRun> run;
  interruptible(
      [&](const Progress& progress) {
        task.options.progress = progress;
        run = report::run_calibration(arm.robot.robot, measurements_of(measured, arm.robot.robot, {}, reading),
                                      test_reader(test, {}, reading), task);
      },
      report);
  if (run->is_implausible) throw refused(run->refusal, words(run->input_mistakes, outcome.face()));
  if (!run->refusal.empty()) outcome.warn()(finding("not_converged", run->refusal));
  std::ranges::for_each(run->measurements.warnings, outcome.warn());
  std::ranges::for_each(run->input_mistakes, outcome.warn());
  run->report.calibration.robot.calibration->made_from = report::provenance_of(report::Json::parse(made_from));
  const report::Document document = report::calibration_document(*run);
  nb::dict result = outcome.dict(report::document_text(document), report::calibration_json(*run, ""));
  result["document"] = report::to_json(document).dump(-1, ' ', false, report::Json::error_handler_t::replace);
  result["robot"] = arm_of(arm, run->report.best());
  nb::dict errors;
  for (const report::JudgedModel& model : run->models) {
    const bool held_out = model.stage.held_out_mm.size() > 0;
    errors[model.name.c_str()] = numbers_of(held_out ? model.stage.held_out_mm : model.stage.in_sample_mm);
  }
  result["errors"] = errors;
  result["page"] = page_of(page, [&] { return report::calibration_page(*run); });
  return result;
}

// The catalogue in a file or a text; the default one without either.
std::vector<robotics::EffectType> catalogue_of(const std::optional<Source>& source) {
  if (!source) return robotics::effect_types();
  return source->second ? robotics::parse_catalogue(*source->second, source->first)
                        : robotics::read_catalogue(source->first);
}

nb::dict discover(const Arm& arm, const Source& measured, const std::optional<Source>& test, const Reading& reading,
                  const std::string& made_from, double held_out, int folds, bool contiguous,
                  const std::optional<Source>& catalogue, double mass_uncertainty, const std::string& accept_suspicion,
                  std::uint64_t seed, bool page, const nb::object& report) {
  require_page(page);
  Outcome outcome(python_face(measured.second));
  report::DiscoveryTask task{.robot_file = arm.name, .folds = folds, .contiguous = contiguous};
  task.accept_suspicion = accept_suspicion;
  task.face = outcome.face();
  task.options.catalogue = catalogue_of(catalogue);
  task.options.held_out_share = held_out;
  task.options.mass_uncertainty = mass_uncertainty;
  task.options.seed = seed;
  std::optional<report::DiscoveryRun> run;
  std::optional<robotics::Measurements> judged;  // by the picture of the errors
  const auto work = [&](const Progress& progress) {
    task.options.progress = progress;
    const std::vector<std::string> also = report::searched_columns(task.options.catalogue, arm.robot.robot);
    const ReadTest read_test = test_reader(test, also, reading);
    run = report::run_discovery(arm.robot.robot, measurements_of(measured, arm.robot.robot, also, reading), read_test,
                                task, outcome.warn());
    judged = report::points_of(read_test ? read_test(run->robot) : run->measurements);
  };
  try {
    interruptible(work, report);
  } catch (const std::runtime_error& error) {
    throw refused(error.what(), outcome.warnings());
  }
  if (auto& record = run->found.improved.robot.calibration)
    record->made_from = report::provenance_of(report::Json::parse(made_from));
  nb::dict result = outcome.dict(report::discovery_text(*run, measured.first, report::no_width_limit, outcome.face()),
                                 report::discovery_run_json(*run));
  result["robot"] = arm_of(arm, run->found.improved);
  const std::vector<bool> set_aside = report::are_set_aside(*run);
  const auto errors_of = [&](const robotics::CorrectedRobot& robot, const Eigen::VectorXd& judging) {
    std::vector<double> errors = numbers_of(robotics::distances(robotics::positions(robot, judged->poses), *judged));
    const double* next = judging.data();
    for (std::size_t k = 0; k < set_aside.size(); ++k) errors[k] = set_aside[k] ? *next++ : errors[k];
    return errors;
  };
  result["errors"] = nb::dict();
  result["errors"]["before"] = errors_of({run->found.before, {}}, run->found.held_out.before_mm);
  result["errors"]["after"] = errors_of(run->found.improved, run->found.held_out.after_mm);
  result["set_aside"] = set_aside;
  result["page"] = page_of(page, [&] {
    return report::discovery_report(
        {arm.name, measured.first, report::points_of(run->measurements), run->found, run->next});
  });
  return result;
}

nb::dict check(const Arm& arm, const Source& measured, const Reading& reading, bool same_session,
               std::optional<double> accuracy_mm, double level, const nb::object& report) {
  robotics::CorrectedRobot robot = arm.robot;
  if (!same_session) robot.robot = report::for_any_session(robot.robot);
  const robotics::CheckOptions options{.same_session = same_session, .accuracy_mm = accuracy_mm, .level = level};
  robotics::Measurements measurements;
  robotics::RobotCheck found;
  interruptible(
      [&](const Progress& progress) {
        Work work(progress);
        measurements = measurements_of(measured, robot.robot, {}, reading);
        work.did(0.5);
        found = report::run_check(arm.name, measured.first, robot, measurements, options);
      },
      report);
  const report::CheckFacts facts{
      arm.name, measured.first, robot.robot, measurements, options, found, python_face(measured.second)};
  nb::dict result = Outcome().dict(report::check_text(facts), report::check_json(facts));
  result["summary"] = report::check_summary(facts);
  result["errors"] = numbers_of(found.errors_mm);
  return result;
}

nb::dict poses(const Arm& arm, const Reading& reading, Eigen::Index count, const std::optional<Source>& from,
               const std::optional<Source>& measured, const std::optional<Source>& use, const std::vector<double>& box,
               const std::vector<double>& tool, double spacing, const std::string& criterion, double noise_um,
               const std::vector<std::string>& fixed, const std::vector<std::string>& only, std::uint64_t seed,
               const nb::object& report) {
  const robotics::Robot robot = report::robot_to_measure(arm.robot.robot, tool);
  robotics::PoseSelectionOptions options{.count = count, .spacing_deg = spacing, .noise_mm = 1e-3 * noise_um};
  options.criterion = report::pose_criterion(criterion);
  if (!box.empty()) options.box = robotics::ToolBox{{box[0], box[2], box[4]}, {box[1], box[3], box[5]}};
  options.calibration.fixed = fixed;
  options.calibration.only = only;
  options.seed = seed;
  robotics::PosePlan plan;
  robotics::PoseSelection selection;
  interruptible(
      [&](const Progress& progress) {
        options.progress = progress;
        const Reading plain{.columns = {}, .decimal_comma = reading.decimal_comma};
        if (from) plan.candidates = poses_of(*from, robot, plain).poses;
        if (measured) plan.measured = poses_of(*measured, robot, reading).poses;
        if (use) plan.use = poses_of(*use, robot, plain).poses;
        selection = robotics::select_poses(robot, plan, options);
      },
      report);
  const report::PoseFacts facts{arm.name,
                                from ? from->first : "",
                                use ? use->first : "",
                                noise_um,
                                robot,
                                plan,
                                options,
                                selection,
                                python_face(use ? use->second : std::nullopt)};
  nb::dict result = Outcome().dict(report::poses_text(facts), report::poses_json(facts, ""));
  result["csv"] = report::poses_csv(robot, selection.poses);
  return result;
}

nb::dict compensate(const Arm& arm, const Source& targets, const Arm* nominal, const Reading& reading,
                    bool in_base_frame, bool nominal_frames, bool position_only, double tolerance_um,
                    const nb::object& report) {
  report::CompensationTask task{.robot_file = arm.name,
                                .targets_file = targets.first,
                                .nominal_file = "nominal",
                                .in_base_frame = in_base_frame,
                                .nominal_frames = nominal_frames,
                                .position_only = position_only,
                                .tolerance_mm = 1e-3 * tolerance_um};
  if (nominal != nullptr) task.read_nominal = [nominal] { return nominal->robot.robot.chain; };
  Outcome outcome(python_face(targets.second));
  std::optional<report::CompensationRun> run;
  interruptible(
      [&](const Progress& progress) {
        task.progress = progress;
        const robotics::CorrectedRobot alone = report::arm_alone(arm.name, arm.robot, outcome.warn());
        run = report::run_compensation(alone, targets_of(targets, alone.robot, reading), task, outcome.warn());
      },
      report);
  if (const auto refusal = report::compensation_refusal(*run)) outcome.warn()(*refusal);
  nb::dict result = outcome.dict(report::compensation_text(*run, ""), report::compensation_json(*run, ""));
  result["csv"] = report::commands_csv(*run);
  result["before_mm"] = numbers_of(run->found.before_mm);
  return result;
}

nb::dict simulate(const Arm& arm, Eigen::Index count, const std::optional<Source>& at, const Reading& reading,
                  double noise_um, std::uint64_t seed) {
  std::string csv;
  interruptible(
      [&](const Progress& progress) {
        std::optional<robotics::Poses> given;
        if (at) given = poses_of(*at, arm.robot.robot, reading).poses;
        const robotics::SimulationOptions options{
            .poses = count, .noise_um = noise_um, .seed = seed, .progress = progress};
        csv = robotics::to_csv(report::simulated_table(arm.name, arm.robot, given, options), arm.robot.robot);
      },
      nb::none());
  nb::dict result = Outcome().dict("", nullptr);
  result["csv"] = csv;
  return result;
}

nb::dict predict_poses(const Arm& arm, const Source& at, const Reading& reading, bool as_measured) {
  Outcome outcome;
  std::string csv;
  interruptible(
      [&](const Progress& progress) {
        const robotics::CorrectedRobot robot =
            as_measured ? arm.robot : report::arm_alone(arm.name, arm.robot, outcome.warn());
        const auto [given, columns] = poses_of(at, robot.robot, reading);
        csv = robotics::to_csv(
            report::predicted_table(arm.name, robot, given, reading.map().orientation, outcome.warn(), progress),
            robot.robot, columns);
      },
      nb::none());
  nb::dict result = outcome.dict("", nullptr);
  result["csv"] = csv;
  return result;
}

// C source and header.
nb::dict export_c(const Arm& arm, const std::string& name, const std::string& session, const std::string& target) {
  Outcome outcome;
  robotics::CorrectedRobot robot = report::arm_alone(arm.name, arm.robot, outcome.warn());
  robot.robot.chain = robotics::in_session(std::move(robot.robot.chain), session, target);
  const CSource c = robotics::to_c(robot, name, name + ".h");
  nb::dict result = outcome.dict("", nullptr);
  result["source"] = c.source;
  result["header"] = c.header;
  return result;
}

// The geometry: differences from `nominal`, or poses of the joints, with origins like those of `origins`.
nb::dict export_geometry(const Arm& arm, const Arm* nominal, const Arm* origins, bool zeros, const std::string& session,
                         const std::string& target) {
  Outcome outcome;
  robotics::CorrectedRobot robot = arm.robot;
  robot.robot.chain = robotics::in_session(std::move(robot.robot.chain), session, target);
  const auto chain_of = [](const Arm* one) { return one != nullptr ? &one->robot.robot.chain : nullptr; };
  return outcome.dict(report::geometry_table(robot, {chain_of(nominal), zeros, chain_of(origins)}, outcome.warn()),
                      nullptr);
}

}  // namespace

void add_robot_tasks(nb::module_& module) {
  using nb::arg;
  module.def("calibrate", &calibrate, arg("robot"), arg("measured"), arg("test").none(), arg("reading"), nb::kw_only(),
             arg("made_from"), arg("correct"), arg("boost"), arg("folds"), arg("contiguous"), arg("new_session"),
             arg("robust"), arg("fixed"), arg("only"), arg("priors"), arg("max_leaves"), arg("min_leaf"),
             arg("accept_suspicion"), arg("limit_mm"), arg("seed"), arg("threads"), arg("quality"), arg("page"),
             arg("report").none());
  module.def("discover", &discover, arg("robot"), arg("measured"), arg("test").none(), arg("reading"), nb::kw_only(),
             arg("made_from"), arg("held_out"), arg("folds"), arg("contiguous"), arg("catalogue").none(),
             arg("mass_uncertainty"), arg("accept_suspicion"), arg("seed"), arg("page"), arg("report").none());
  module.def("check", &check, arg("robot"), arg("measured"), arg("reading"), nb::kw_only(), arg("same_session"),
             arg("accuracy_mm").none(), arg("level"), arg("report").none());
  module.def("poses", &poses, arg("robot"), arg("reading"), nb::kw_only(), arg("count"), arg("candidates").none(),
             arg("measured").none(), arg("use").none(), arg("box"), arg("tool"), arg("spacing"), arg("criterion"),
             arg("noise_um"), arg("fixed"), arg("only"), arg("seed"), arg("report").none());
  module.def("compensate", &compensate, arg("robot"), arg("targets"), arg("nominal").none(), arg("reading"),
             nb::kw_only(), arg("in_base_frame"), arg("nominal_frames"), arg("position_only"), arg("tolerance_um"),
             arg("report").none());
  module.def("simulate", &simulate, arg("robot"), arg("count"), arg("at").none(), arg("reading"), nb::kw_only(),
             arg("noise_um"), arg("seed"));
  module.def("predict", &predict_poses, arg("robot"), arg("at"), arg("reading"), nb::kw_only(), arg("as_measured"));
  module.def("export_c", &export_c, arg("robot"), arg("name"), arg("session"), arg("target"));
  module.def("export_geometry", &export_geometry, arg("robot"), arg("nominal").none(), arg("origins").none(),
             arg("zeros"), arg("session"), arg("target"));
}

}  // namespace llmt::python
