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
rule(libraries_know_no_apps FILES "${library}" BANNED "^[\"<](apps|shared|trees)/")
rule(reports_know_no_programs FILES "^apps/report/" BANNED "^[\"<](shared/|CLI|robot/|trees/)")
rule(llmt_knows_no_expressions FILES "^llmt/(include|src)/" BANNED "^\"expressions/")
rule(expressions_know_nobody FILES "^llmt/expressions/" BANNED "^[\"<](llmt|robotics|apps|shared)/")
rule(no_parent_folders FILES "^(llmt|robotics|apps)/" BANNED "[.][.]/") # no way around the other rules
# abi, folds, progress, random and statistics know no tree; what discovery needs of them is compiled into both libraries.
rule(discovery_knows_no_trees FILES "${discovery}" BANNED "^\"llmt/" ALLOWED "^\"llmt/(discovery/|abi[.]|folds[.]|progress[.]|random[.]|statistics[.])")
rule(trees_know_no_discovery FILES "^llmt/(include/llmt|src)/" BANNED "^\"(llmt/)?discovery/" EXCEPT "${discovery}")
rule(tbb_in_one_source FILES "." BANNED "^<(oneapi/)?tbb[/.]" EXCEPT "^llmt/src/base/parallel[.]cpp$")
# A standard header has neither folder nor extension.
rule(public_headers_include_eigen_only FILES "${public_header}" BANNED "^<" ALLOWED "^<([a-z_0-9]+>$|Eigen/)")
rule(public_headers_include_public_headers FILES "${public_header}" BANNED "^\"" ALLOWED "^\"llmt/")

# The rooms, from CONTRIBUTING.md: under the folder that holds them, `room <- rooms that it may include | its public headers`.
# A room may include only rooms of lines above its own, so that there is no circle.
file(STRINGS "${ROOT}/CONTRIBUTING.md" lines)
set(folder "")
set(folders)
set(violations "")
foreach(line IN LISTS lines)
  if(line MATCHES "^(llmt|robotics)/src$")
    set(folder "${line}")
    list(APPEND folders "${folder}")
    set(${folder}_rooms)
  elseif(line MATCHES "^```" OR line STREQUAL "")
    set(folder "")
  elseif(folder AND line MATCHES "^  ([a-z_0-9/]+) *(<-([a-z_0-9/ ]*))?([|]([a-z_0-9/ ]*))?$")
    set(room "${CMAKE_MATCH_1}")
    set(below "${CMAKE_MATCH_3}")
    set(headers "${CMAKE_MATCH_5}")
    string(REGEX MATCHALL "[a-z_0-9/]+" below "${below}")
    string(REGEX MATCHALL "[a-z_0-9/]+" headers "${headers}")
    foreach(other IN LISTS below)
      if(NOT other IN_LIST ${folder}_rooms)
        string(APPEND violations "  rooms: ${folder}/${room} may include ${other}, which is not above it in CONTRIBUTING.md\n")
      endif()
    endforeach()
    list(APPEND ${folder}_rooms "${room}")
    set(${folder}/${room}_below ${below})
    foreach(header IN LISTS headers)
      set(${folder}/${header}_owner "${room}")
    endforeach()
  endif()
endforeach()

# room_of(FOLDER INCLUDE RESULT): the room of what a source below FOLDER includes, "" if it is none of FOLDER's.
function(room_of folder include result)
  set(${result} "" PARENT_SCOPE)
  if(folder STREQUAL "robotics/src")
    set(public "^\"llmt/robotics/([a-z_0-9/]+)[.]hpp\"$")
  else()
    set(public "^\"llmt/([a-z_0-9]+)[.]hpp\"$")
  endif()
  if(include MATCHES "${public}")
    set(${result} "${${folder}/${CMAKE_MATCH_1}_owner}" PARENT_SCOPE)
  elseif(include MATCHES "^\"(.*)/[a-z_0-9]+[.]hpp\"$" AND CMAKE_MATCH_1 IN_LIST ${folder}_rooms)
    set(${result} "${CMAKE_MATCH_1}" PARENT_SCOPE)
  elseif(include MATCHES "^\"[a-z_0-9]+[.]hpp\"$")
    set(${result} "a header without its room" PARENT_SCOPE)
  endif()
endfunction()

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

foreach(folder IN LISTS folders)
  foreach(source IN LISTS sources)
    if(NOT source MATCHES "^${folder}/(.*)/[^/]*$")
      continue()
    endif()
    set(room "${CMAKE_MATCH_1}")
    if(NOT room IN_LIST ${folder}_rooms)
      string(APPEND violations "  rooms: ${source} is in no room of CONTRIBUTING.md\n")
      continue()
    endif()
    file(STRINGS "${ROOT}/${source}" lines REGEX "^[ \t]*#[ \t]*include[ \t]*\"")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^[^\"]*(\"[^\"]*\").*" "\\1" include "${line}")
      room_of("${folder}" "${include}" other)
      if(NOT other STREQUAL ""
         AND NOT other STREQUAL room
         AND NOT other IN_LIST ${folder}/${room}_below)
        string(APPEND violations "  rooms: ${source} includes ${include}: ${room} does not know ${other}\n")
      endif()
    endforeach()
  endforeach()
endforeach()

if(violations)
  message(FATAL_ERROR "The include lines break the layer rules (see CONTRIBUTING.md):\n${violations}")
endif()
list(LENGTH sources count)
message(STATUS "${count} sources keep the layer rules")
