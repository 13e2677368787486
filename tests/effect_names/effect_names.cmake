# cmake -D ROOT=<checkout> -P effect_names.cmake: what the library and the programs must know of an effect stands in its row, see
# EffectType. This lists the lines outside of robotics/src/effects that ask for an effect by its name.
cmake_minimum_required(VERSION 3.25)
# With a relative folder nothing would be found.
get_filename_component(ROOT "${ROOT}" ABSOLUTE BASE_DIR "${CMAKE_SOURCE_DIR}")

# The studies of two published arms, and one question of discovery: would soft joints explain the errors?
set(most_lines 3)

file(STRINGS "${ROOT}/robotics/catalogue.yaml" entries REGEX "^  - type: ")
list(TRANSFORM entries REPLACE "^  - type: " "")
list(JOIN entries "|" names)
if(names STREQUAL "")
  message(FATAL_ERROR "no effects in ${ROOT}/robotics/catalogue.yaml")
endif()

set(found "")
set(count 0)
foreach(folder IN ITEMS robotics/include robotics/src apps)
  file(GLOB_RECURSE sources RELATIVE "${ROOT}" "${ROOT}/${folder}/*.[ch]pp")
  if(NOT sources)
    message(FATAL_ERROR "no sources in ${ROOT}/${folder}")
  endif()
  list(FILTER sources EXCLUDE REGEX "^robotics/src/effects/")
  foreach(source IN LISTS sources)
    file(STRINGS "${ROOT}/${source}" lines REGEX "\"(${names})[_\"]")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "//.*" "" code "${line}")
      # A program's own word, not the type "formula".
      if(source MATCHES "^apps/")
        string(REPLACE "\"formula\"" "" code "${code}")
      endif()
      if(code MATCHES "\"(${names})[_\"]")
        math(EXPR count "${count} + 1")
        string(STRIP "${code}" code)
        string(APPEND found "  ${source}: ${code}\n")
      endif()
    endforeach()
  endforeach()
endforeach()

message(STATUS "${count} lines ask for an effect by its name:\n${found}")
if(count GREATER most_lines)
  message(FATAL_ERROR "At most ${most_lines} may: ask its row, EffectType, instead.")
endif()
