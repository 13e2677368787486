# What building needs. All that is missing is named at once, by the Debian packages that have it.
set(llmt_missing_packages "")

# llmt_require(DEBIAN_PACKAGE <argument of find_package>...). A macro, for what find_package sets belongs to the caller.
macro(llmt_require debian_package name)
  find_package(${name} ${ARGN} QUIET)
  if(NOT ${name}_FOUND)
    list(APPEND llmt_missing_packages ${debian_package})
  endif()
endmacro()

# llmt_require_header(DEBIAN_PACKAGE VARIABLE HEADER <argument of find_path>...): VARIABLE becomes the folder of HEADER.
macro(llmt_require_header debian_package variable header)
  find_path(${variable} ${header} ${ARGN})
  mark_as_advanced(${variable})
  if(NOT ${variable})
    list(APPEND llmt_missing_packages ${debian_package})
  endif()
endmacro()

# llmt_require_all(): stops if anything was missing.
function(llmt_require_all)
  if(llmt_missing_packages)
    list(JOIN llmt_missing_packages " " packages)
    message(
      FATAL_ERROR "llmt: libraries that it is built with were not found. On Debian and Ubuntu:\n"
                  "  apt-get install ${packages}\n" # a line that begins with blanks is not broken
                  "On other systems install their equivalents; README.md, Requirements, names them.")
  endif()
endfunction()

# llmt_enable_language(): C++. Without a compiler no library can be looked for, so all that may be missing is named. pip sets
# CXX to the compiler that Python was built with, whether it is there or not.
macro(llmt_enable_language)
  include(CheckLanguage)
  check_language(CXX)
  if(NOT CMAKE_CXX_COMPILER)
    set(llmt_named_compiler "")
    if(DEFINED ENV{CXX})
      set(llmt_named_compiler " (CXX names $ENV{CXX})")
    endif()
    message(
      FATAL_ERROR
        "llmt: there is no C++ compiler${llmt_named_compiler}. On Debian and Ubuntu:\n"
        "  apt-get install g++ libeigen3-dev libtbb-dev libfast-float-dev libfmt-dev nlohmann-json3-dev libboost-dev "
        "libyaml-cpp-dev libmuparser-dev liburdfdom-dev libtinyxml-dev libexpat1-dev python3-dev\n"
        "On other systems install their equivalents; README.md, Requirements, names them.")
  endif()
  enable_language(CXX)
endmacro()
