# The page that draws reports: bundled by esbuild from page/ and the packages that `cmake/setup report` fetched, and taken into
# the programs. Without the packages the programs are built without reports; --report then says how to get them.
set(LLMT_REPORT_PACKAGES
    "${PROJECT_SOURCE_DIR}/build/report_packages/node_modules"
    CACHE PATH "What the page of the reports is made from; `cmake/setup report` puts it there")
find_program(LLMT_NODE NAMES node nodejs DOC "Node.js, which bundles the page of the reports")
mark_as_advanced(LLMT_NODE)

set(report_page_source report/document/no_page.cpp)
if(LLMT_NODE AND EXISTS "${LLMT_REPORT_PACKAGES}/plotly.js/package.json")
  set(page_sources "${CMAKE_CURRENT_SOURCE_DIR}/report/page")
  set(LLMT_REPORT_PAGE "${CMAKE_CURRENT_BINARY_DIR}/report_page.html")
  file(GLOB page_parts CONFIGURE_DEPENDS "${page_sources}/*")
  add_custom_command(
    OUTPUT "${LLMT_REPORT_PAGE}"
    COMMAND "${LLMT_NODE}" "${page_sources}/bundle.mjs" "${LLMT_REPORT_PACKAGES}" "${LLMT_REPORT_PAGE}"
    DEPENDS ${page_parts}
    COMMENT "Bundling the page of the reports"
    VERBATIM)
  configure_file(report/document/embedded_page.cpp.in embedded_page.cpp @ONLY)
  set(report_page_source "${CMAKE_CURRENT_BINARY_DIR}/embedded_page.cpp")
  set_source_files_properties("${report_page_source}" PROPERTIES OBJECT_DEPENDS "${LLMT_REPORT_PAGE}")
  message(STATUS "llmt: programs with HTML reports")
else()
  message(STATUS "llmt: programs without HTML reports (--report); `cmake/setup report` builds them with")
endif()
