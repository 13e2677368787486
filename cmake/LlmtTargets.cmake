# What every target of this project shares. Nothing here reaches a consumer: all of it is PRIVATE.

# llmt_target_defaults(TARGET): C++20, warnings, and arithmetic that does not depend on the machine.
function(llmt_target_defaults target)
  set_target_properties(${target} PROPERTIES CXX_STANDARD 20 CXX_STANDARD_REQUIRED ON CXX_EXTENSIONS OFF)
  target_compile_options(
    ${target}
    PRIVATE
      # A fused multiply-add rounds once instead of twice; left to itself the compiler fuses where the target has the
      # instruction, and the same data would give other bytes of model on another machine.
      $<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-ffp-contract=off>
      $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-Wall;-Wextra;-Wpedantic;-Wshadow;-Wconversion;-Wno-sign-conversion>>
  )
  # GCC collects garbage each time its heap has doubled, which takes a twentieth of the time of large sources; here when it is
  # fivefold. That takes up to a quarter more memory.
  if(LLMT_UNITY_BUILD)
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-expand=400>)
  endif()
  # Without it Eigen asks the processor for the sizes of its caches and cuts products of matrices by them: the sums of a
  # product would round differently with a first cache of 48 KiB than with one of 32.
  target_compile_definitions(${target} PRIVATE EIGEN_NO_CPUID)
endfunction()

# Eigen's templates are instantiated again in every source; the sources of a room compiled as one take less than half of the time.
option(LLMT_UNITY_BUILD "Compile the sources of a room of a library as one, for builds from scratch" OFF)

# llmt_library(TARGET NAME): the alias llmt::NAME, and what an exported library needs. The caller adds sources, the header
# file set and dependencies.
function(llmt_library target name)
  add_library(llmt::${name} ALIAS ${target})
  llmt_target_defaults(${target})
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(
    ${target}
    PROPERTIES EXPORT_NAME ${name}
               VERSION ${PROJECT_VERSION}
               SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
               POSITION_INDEPENDENT_CODE ON
               VERIFY_INTERFACE_HEADER_SETS ON)
endfunction()

# llmt_rooms(TARGET EXCEPT <regex>... TOGETHER <regex>...): adds every source below this folder but those whose path matches
# EXCEPT. With LLMT_UNITY_BUILD the sources of a room are compiled as one, as are all rooms that match the same TOGETHER.
function(llmt_rooms target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "EXCEPT;TOGETHER")
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS RELATIVE "${CMAKE_CURRENT_SOURCE_DIR}" *.cpp)
  foreach(regex IN LISTS arg_EXCEPT)
    list(FILTER sources EXCLUDE REGEX "${regex}")
  endforeach()
  target_sources(${target} PRIVATE ${sources})
  llmt_unity_by_room(${target} SOURCES ${sources} TOGETHER ${arg_TOGETHER})
endfunction()

# llmt_unity_by_room(TARGET SOURCES <source>... TOGETHER <regex>...): with LLMT_UNITY_BUILD the sources of a folder are compiled as
# one, as are all that match the same TOGETHER.
function(llmt_unity_by_room target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;TOGETHER")
  if(NOT LLMT_UNITY_BUILD)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  foreach(source IN LISTS arg_SOURCES)
    get_filename_component(room "${source}" DIRECTORY)
    string(REPLACE "${PROJECT_SOURCE_DIR}/" "" room "${room}")
    string(MAKE_C_IDENTIFIER "${room}" room)
    set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${room}")
  endforeach()
  foreach(regex IN LISTS arg_TOGETHER)
    set(together ${arg_SOURCES})
    list(FILTER together INCLUDE REGEX "${regex}")
    list(GET together 0 first)
    string(MAKE_C_IDENTIFIER "${first}" group)
    set_source_files_properties(${together} PROPERTIES UNITY_GROUP "${group}")
  endforeach()
endfunction()

# Eigen, fmt, GoogleTest and the standard library are most of what an average source compiles. With LLMT_PRECOMPILE_HEADERS they
# are compiled once for all targets that share their flags. Each source includes what it uses all the same: the test
# `consumer_sources`, the preset `dev` and the header sets are built without.

# llmt_precompile(NAME HEADERS <header>... LIBS <target>...): a target that only compiles the headers. The caller gives it the
# flags of those that reuse it.
function(llmt_precompile name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "HEADERS;LIBS")
  set(source "${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp")
  file(CONFIGURE OUTPUT "${source}" CONTENT "")
  add_library(${name} OBJECT "${source}")
  llmt_target_defaults(${name})
  target_link_libraries(${name} PRIVATE ${arg_LIBS})
  target_precompile_headers(${name} PRIVATE ${arg_HEADERS})
  foreach(library IN LISTS arg_LIBS)
    foreach(kind IN ITEMS DEFINITIONS OPTIONS)
      get_target_property(values ${library} INTERFACE_COMPILE_${kind})
      if(values)
        set_property(TARGET ${name} APPEND PROPERTY LLMT_${kind} "${values}")
      endif()
    endforeach()
  endforeach()
endfunction()

# llmt_reuse_precompiled(TARGET NAME): TARGET sees the headers of NAME, if there is such a target. GCC refuses precompiled headers
# whose macros differ, so TARGET gets the flags of NAME's libraries, whether it links them or not.
function(llmt_reuse_precompiled target name)
  if(TARGET ${name})
    target_precompile_headers(${target} REUSE_FROM ${name})
    get_property(definitions TARGET ${name} PROPERTY LLMT_DEFINITIONS)
    get_property(options TARGET ${name} PROPERTY LLMT_OPTIONS)
    target_compile_definitions(${target} PRIVATE ${definitions})
    target_compile_options(${target} PRIVATE ${options})
  endif()
endfunction()
