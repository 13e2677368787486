# cmake -D WORK_DIR=<scratch> -P self_test.cmake: every rule of docs.cmake is seen to fail on a page that breaks it, and pages
# that keep them all pass.
cmake_minimum_required(VERSION 3.25)

string(REPEAT "word " 24 columns_120) # 120 columns with the last blank
string(REPEAT "→ " 60 arrows) # 120 columns, 240 bytes
string(REPEAT "x" 130 one_word)

# check(EXPECTED LINE...): docs/page.md with these LINEs breaks the rule EXPECTED, or none where that is "none".
function(check expected)
  list(JOIN ARGN "\n" text)
  file(REMOVE_RECURSE "${WORK_DIR}")
  file(WRITE "${WORK_DIR}/docs/algorithms/growth.md" "# Growth\n\n    F = 1      (G.1)\n    P = [2; 3]  (G.2)\n")
  file(WRITE "${WORK_DIR}/docs/page.md" "${text}\n")
  file(WRITE "${WORK_DIR}/llmt/src/growth.cpp" "${source}\n")
  execute_process(
    COMMAND "${CMAKE_COMMAND}" "-DROOT=${WORK_DIR}" -P "${CMAKE_CURRENT_LIST_DIR}/docs.cmake"
    RESULT_VARIABLE result
    OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  string(REGEX MATCHALL "(width|dead_link|equation): [^\n]*" found "${output}")
  if(expected STREQUAL "none")
    if(NOT result EQUAL 0)
      message(SEND_ERROR "a page with\n${text}\nwas to pass, but the test said:\n${output}")
    endif()
  elseif(result EQUAL 0 OR NOT found MATCHES "^${expected}: [^\n;]*$")
    message(SEND_ERROR "a page with\n${text}\nwas to break: ${expected}\nbut the test said:\n${output}")
  endif()
endfunction()

set(source "// The F test (G.1), see (G.2).")
check(none "${columns_120}" "- ${one_word}" "| ${columns_120} | more |" "```" "${columns_120} more" "```")
check(none "${arrows}" "[a](algorithms/growth.md#best) [b](#here) [c](https://example.org/x) [d](algorithms)")
check(none "Cited (G.1, G.2)" "a \\ backslash" "[0, 1) and ]")
check(width "${columns_120}more")
check(width "```" "code" "```" "- ${columns_120}more")
check(width "${arrows}→ →")
check(dead_link "[a](algorithms/no.md)")
check(dead_link "[a](algorithms/growth.md) and [b](../README.md)")
check(equation "Cited (G.3)")
check(equation "Cited (G.1, G.9)")
set(source "double x = 1.0;  // by (E.4)")
check(equation "No equation")
file(REMOVE_RECURSE "${WORK_DIR}")
