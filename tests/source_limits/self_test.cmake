# cmake -D WORK_DIR=<scratch> -P self_test.cmake: both limits are seen to fail on a source that breaks them, and a source
# exactly at the limits passes.
cmake_minimum_required(VERSION 3.25)

string(REPEAT "x" 120 columns_120)
string(REPEAT "→" 120 arrows_120)
string(REPEAT "int a[2];\n\n" 175 lines_350)

# check(EXPECTED FILE TEXT): FILE with TEXT leads to the one finding EXPECTED, or to none where that is "none".
function(check expected file text)
  file(REMOVE_RECURSE "${WORK_DIR}")
  file(WRITE "${WORK_DIR}/${file}" "${text}")
  execute_process(
    COMMAND "${CMAKE_COMMAND}" "-DROOT=${WORK_DIR}" -P "${CMAKE_CURRENT_LIST_DIR}/source_limits.cmake"
    RESULT_VARIABLE result
    OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  string(REGEX MATCHALL "(length|width): [^\n]*" found "${output}")
  if(expected STREQUAL "none" AND result EQUAL 0)
    return()
  endif()
  if(result EQUAL 0 OR NOT found STREQUAL expected)
    message(SEND_ERROR "${file} was to lead to: ${expected}\nbut the test said:\n${output}")
  endif()
endfunction()

check(none llmt/src/fit/fit.cpp "${lines_350}")
check(none tests/llmt/fit/fit_test.cpp "${columns_120}\n\n${arrows_120}")
check("length: robotics/include/llmt/robotics/chain.hpp has 351 lines" robotics/include/llmt/robotics/chain.hpp
      "${lines_350}int b;\n")
check("length: apps/trees/main.cpp has 352 lines" apps/trees/main.cpp "${lines_350}\nint b;")
check("width: bench/data_sets.cpp:3 has 121 columns" bench/data_sets.cpp "\\\n[\n${columns_120}x\n]\n;\n")
check("width: docs/examples/fit.cpp:1 has 121 columns" docs/examples/fit.cpp "→${arrows_120}\n")
file(REMOVE_RECURSE "${WORK_DIR}")
