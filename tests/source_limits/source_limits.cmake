# cmake -D ROOT=<checkout> -P source_limits.cmake: the C++ sources keep these limits.
#   length  A file has at most 350 lines.
#   width   A line has at most 120 columns.
cmake_minimum_required(VERSION 3.25)

set(most_lines 350)
set(most_columns 120)

# The bytes of UTF-8 that continue a character: without them a string has one byte for each character.
foreach(byte RANGE 128 191)
  string(ASCII ${byte} continuation)
  string(APPEND continuations "${continuation}")
endforeach()

# read_lines(PATH RESULT): the lines of a file as a list. Characters that mean something in a list become "x".
function(read_lines path result)
  file(READ "${path}" text)
  string(REGEX REPLACE "\n$" "" text "${text}")
  string(REGEX REPLACE "[][;\\]" "x" text "${text}")
  # A list has no element for an empty line at its end or in a list of one, so that no line is left empty.
  string(REPLACE "\n" " ;" text "${text} ")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

set(violations "")
set(count 0)
foreach(folder IN ITEMS llmt expressions robotics apps tests bench docs)
  file(GLOB_RECURSE sources RELATIVE "${ROOT}" "${ROOT}/${folder}/*.[ch]pp")
  foreach(source IN LISTS sources)
    math(EXPR count "${count} + 1")
    read_lines("${ROOT}/${source}" lines)
    list(LENGTH lines length)
    if(length GREATER most_lines)
      string(APPEND violations "  length: ${source} has ${length} lines\n")
    endif()
    set(number 0)
    foreach(line IN LISTS lines)
      math(EXPR number "${number} + 1")
      string(LENGTH "${line}" columns)
      if(columns GREATER most_columns)
        string(REGEX REPLACE "[${continuations}]" "" line "${line}")
        string(LENGTH "${line}" columns)
        math(EXPR columns "${columns} - 1") # the blank that read_lines adds
        if(columns GREATER most_columns)
          string(APPEND violations "  width: ${source}:${number} has ${columns} columns\n")
        endif()
      endif()
    endforeach()
  endforeach()
endforeach()

if(count EQUAL 0)
  message(FATAL_ERROR "no sources under ${ROOT}")
endif()
if(violations)
  message(FATAL_ERROR "Sources are longer than ${most_lines} lines or wider than ${most_columns} columns:\n${violations}")
endif()
message(STATUS "${count} sources have at most ${most_lines} lines of at most ${most_columns} columns")
