# cmake -D ROOT=<checkout> -P include_rules.cmake: who may include whom, read from the include lines.
cmake_minimum_required(VERSION 3.25)

# A rule: files whose path matches FILES must not include what matches BANNED, unless the include matches ALLOWED or the path
# matches EXCEPT. Paths are relative to ROOT; an include is written as in the source, with its quotes or angle brackets. A dot
# is [.], for macro arguments lose a backslash.
set(rules)
macro(rule name)
  cmake_parse_arguments(rule "" "FILES;BANNED;ALLOWED;EXCEPT" "" ${ARGN})
  list(APPEND rules ${name})
  foreach(field IN ITEMS FILES BANNED ALLOWED EXCEPT)
    set(${name}_${field} "^$")
    if(DEFINED rule_${field})
      set(${name}_${field} "${rule_${field}}")
    endif()
  endforeach()
endmacro()

set(library "^(llmt|robotics)/")
set(public_header "^(llmt|robotics)/include/")
set(discovery "^llmt/(include/llmt|src)/discovery/")

rule(llmt_knows_no_robotics FILES "^llmt/" BANNED "^[\"<](llmt/)?robotics/")
rule(libraries_know_no_apps FILES "${library}" BANNED "^[\"<](apps|shared|report|robot)/")
rule(no_parent_folders FILES "^(llmt|robotics|apps)/" BANNED "[.][.]/") # no way around the other rules
# abi, folds and random know no tree; what discovery needs of them is compiled into both libraries.
rule(discovery_knows_no_trees FILES "${discovery}" BANNED "^\"llmt/" ALLOWED "^\"llmt/(discovery/|abi[.]|folds[.]|random[.])")
rule(trees_know_no_discovery FILES "^llmt/(include/llmt|src)/[^/]*$" BANNED "^\"(llmt/)?discovery/")
rule(tbb_in_one_source FILES "." BANNED "^<(oneapi/)?tbb[/.]" EXCEPT "^llmt/src/parallel[.]cpp$")
# A standard header has neither folder nor extension.
rule(public_headers_include_eigen_only FILES "${public_header}" BANNED "^<" ALLOWED "^<([a-z_0-9]+>$|Eigen/)")
rule(public_headers_include_public_headers FILES "${public_header}" BANNED "^\"" ALLOWED "^\"llmt/")

file(
  GLOB_RECURSE sources
  RELATIVE "${ROOT}"
  "${ROOT}/llmt/*.[ch]pp"
  "${ROOT}/robotics/*.[ch]pp"
  "${ROOT}/apps/*.[ch]pp"
  "${ROOT}/tests/*.[ch]pp"
  "${ROOT}/bench/*.[ch]pp")
if(NOT sources)
  message(FATAL_ERROR "no sources under ${ROOT}")
endif()

set(violations "")
foreach(source IN LISTS sources)
  file(STRINGS "${ROOT}/${source}" lines REGEX "^[ \t]*#[ \t]*include[ \t]*[\"<]")
  set(includes)
  foreach(line IN LISTS lines)
    string(REGEX REPLACE "^[^\"<]*([\"<][^\">]*[\">]).*" "\\1" include "${line}")
    list(APPEND includes "${include}")
    foreach(rule IN LISTS rules)
      if(source MATCHES "${${rule}_FILES}"
         AND include MATCHES "${${rule}_BANNED}"
         AND NOT include MATCHES "${${rule}_ALLOWED}"
         AND NOT source MATCHES "${${rule}_EXCEPT}")
        string(APPEND violations "  ${rule}: ${source} includes ${include}\n")
      endif()
    endforeach()
  endforeach()
  # The guard against other alignments works only where it is seen.
  if(source MATCHES "${public_header}"
     AND includes MATCHES "<Eigen/"
     AND NOT source MATCHES "/abi[.]hpp$"
     AND NOT "\"llmt/abi.hpp\"" IN_LIST includes)
    string(APPEND violations "  eigen_comes_with_abi: ${source} includes Eigen but not llmt/abi.hpp\n")
  endif()
endforeach()

if(violations)
  message(FATAL_ERROR "The include lines break the layer rules (see CONTRIBUTING.md):\n${violations}")
endif()
list(LENGTH sources count)
message(STATUS "${count} sources keep the layer rules")
