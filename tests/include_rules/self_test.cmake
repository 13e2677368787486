# cmake -D WORK_DIR=<scratch> -P self_test.cmake: every layer rule is seen to fail on a small tree that breaks it, and a tree
# that keeps them all passes.
cmake_minimum_required(VERSION 3.25)

# check(EXPECTED FILE LINE...): a tree of one FILE with these LINEs breaks the rule EXPECTED, or none where that is "none".
set(rooms "llmt/src\n  base | abi parallel\n  model <- base | model\n  fit <- base model | fit\n  discovery <- base model fit")
function(check expected file)
  list(JOIN ARGN "\n" text)
  file(REMOVE_RECURSE "${WORK_DIR}")
  file(WRITE "${WORK_DIR}/${file}" "${text}\n")
  file(WRITE "${WORK_DIR}/CONTRIBUTING.md" "```\n${rooms}\n```\n")
  execute_process(
    COMMAND "${CMAKE_COMMAND}" "-DROOT=${WORK_DIR}" -P "${CMAKE_CURRENT_LIST_DIR}/include_rules.cmake"
    RESULT_VARIABLE result
    OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  if(expected STREQUAL "none" AND result EQUAL 0)
    return()
  endif()
  string(REGEX MATCHALL "[a-z_]+: ${file}" found "${output}") # every rule that spoke, and no other
  if(NOT found STREQUAL "${expected}: ${file}")
    message(SEND_ERROR "${file} with\n${text}\nwas to break: ${expected}\nbut the test said:\n${output}")
  endif()
endfunction()

check(llmt_knows_no_robotics llmt/src/model.cpp "#include \"llmt/robotics/chain.hpp\"")
check(llmt_knows_no_robotics llmt/src/fit.cpp "  #  include <robotics/chain.hpp>" "#include <vector>")
check(libraries_know_no_apps robotics/src/chain.cpp "#include \"shared/exit_codes.hpp\"")
check(libraries_know_no_apps llmt/src/model/model.cpp "#include \"apps/shared/cli.hpp\"")
check(reports_know_no_programs apps/report/fit/fit_text.cpp "#include \"shared/cli.hpp\"")
check(reports_know_no_programs apps/report/document/page.cpp "#include <CLI/CLI.hpp>")
check(llmt_knows_no_expressions llmt/src/fit/fit.cpp "#include \"expressions/expression.hpp\"")
check(expressions_know_nobody llmt/expressions/expression.cpp "#include \"llmt/csv.hpp\"")
check(no_parent_folders apps/robot/main.cpp "#include \"../shared/exit_codes.hpp\"")
check(discovery_knows_no_trees llmt/src/discovery/verdict.cpp "#include \"llmt/model.hpp\"")
check(discovery_knows_no_trees llmt/include/llmt/discovery/verdict.hpp "#include \"llmt/fit.hpp\"")
check(trees_know_no_discovery llmt/src/fit.cpp "#include \"llmt/discovery/least_squares.hpp\"")
check(tbb_in_one_source llmt/src/fit.cpp "#include <tbb/parallel_for.h>")
check(tbb_in_one_source apps/trees/main.cpp "#include <oneapi/tbb.h>")
check(public_headers_include_eigen_only llmt/include/llmt/model.hpp "#include <nlohmann/json.hpp>")
check(public_headers_include_eigen_only robotics/include/llmt/robotics/chain.hpp "#include <math.h>")
check(public_headers_include_public_headers llmt/include/llmt/model.hpp "#include \"split_search.hpp\"")
check(eigen_comes_with_abi llmt/include/llmt/model.hpp "#include <Eigen/Core>" "#include <vector>")

check(rooms llmt/src/base/parallel.cpp "#include \"model/tree.hpp\"")
check(rooms llmt/src/partition/tree.cpp "#include \"llmt/fit.hpp\"")
check(rooms llmt/src/partition/tree.cpp "#include \"evaluator.hpp\"")
check(rooms llmt/src/attic/tree.cpp "#include <vector>")
check(none llmt/src/fit/fit.cpp "#include \"model/tree.hpp\"" "#include \"llmt/fit.hpp\"" "#include \"fit/defaults.hpp\"")

check(none llmt/src/base/parallel.cpp "#include <tbb/parallel_for.h>" "#include \"base/parallel.hpp\"")
check(none llmt/include/llmt/model.hpp "#include <Eigen/Core>" "#include <vector>" "#include \"llmt/abi.hpp\"")
check(none llmt/src/discovery/verdict.cpp "#include \"llmt/discovery/verdict.hpp\"" "#include \"llmt/folds.hpp\"")
check(none robotics/src/chain.cpp "#include <yaml-cpp/yaml.h>" "#include \"llmt/discovery/verdict.hpp\"")
check(none apps/report/robot/arms.cpp "#include \"report/robot/arms.hpp\"" "#include \"llmt/fit.hpp\"")
check(none apps/robot/main.cpp "#include \"shared/exit_codes.hpp\"" "#include <llmt/robotics/chain.hpp>")
file(REMOVE_RECURSE "${WORK_DIR}")
