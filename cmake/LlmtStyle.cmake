# Targets for those who change the code:
#   format         rewrite all sources as .clang-format says; the test `format` checks the same
#   tidy           clang-tidy over everything in this build's compilation database
# clang-format's output differs between major versions, so only the one the tree is kept in takes part.
set(LLMT_CLANG_FORMAT_VERSION 14)

file(GLOB_RECURSE llmt_sources CONFIGURE_DEPENDS llmt/*.[ch]pp expressions/*.[ch]pp robotics/*.[ch]pp apps/*.[ch]pp
     tests/*.[ch]pp bench/*.[ch]pp)

find_program(LLMT_CLANG_FORMAT NAMES clang-format-${LLMT_CLANG_FORMAT_VERSION} clang-format)
mark_as_advanced(LLMT_CLANG_FORMAT)
if(LLMT_CLANG_FORMAT)
  execute_process(COMMAND "${LLMT_CLANG_FORMAT}" --version OUTPUT_VARIABLE version)
  if(version MATCHES "version ${LLMT_CLANG_FORMAT_VERSION}[.]")
    add_custom_target(format COMMAND "${LLMT_CLANG_FORMAT}" -i ${llmt_sources} VERBATIM)
    if(LLMT_BUILD_TESTING)
      add_test(NAME format COMMAND "${LLMT_CLANG_FORMAT}" --dry-run -Werror ${llmt_sources})
      set_tests_properties(format PROPERTIES LABELS packaging)
    endif()
  else()
    message(STATUS "llmt: clang-format ${LLMT_CLANG_FORMAT_VERSION} not found, the test of the format is left out")
  endif()
endif()

find_program(LLMT_RUN_CLANG_TIDY NAMES run-clang-tidy-14 run-clang-tidy)
mark_as_advanced(LLMT_RUN_CLANG_TIDY)
if(LLMT_RUN_CLANG_TIDY)
  add_custom_target(
    tidy
    COMMAND "${LLMT_RUN_CLANG_TIDY}" -quiet -p "${PROJECT_BINARY_DIR}" "^${PROJECT_SOURCE_DIR}/(llmt|expressions|robotics|apps|tests|bench)/"
    VERBATIM USES_TERMINAL)
endif()
