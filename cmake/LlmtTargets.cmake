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
endfunction()

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
