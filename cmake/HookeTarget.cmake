# What every target of ours has in common. Floating point must not be contracted:
# the same source gives the same bits on every instruction set.

function(hooke_common target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE -ffp-contract=off)
  if(HOOKE_STRICT)
    target_compile_options(
      ${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
                        -Wunused -Wnull-dereference -Werror)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      # gcc 12 reports false positives inside Eigen at -O2.
      target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized -Wno-null-dereference
                                               -Wno-array-bounds -Wno-stringop-overflow -Wno-restrict)
    endif()
  endif()
endfunction()

# hooke_library(name BASE_DIR dir HEADERS ... SOURCES ...): target hooke_name, alias
# hooke::name, installed and exported. Headers are found from BASE_DIR.
function(hooke_library name)
  cmake_parse_arguments(arg "" "BASE_DIR" "HEADERS;SOURCES" ${ARGN})
  set(target hooke_${name})
  if(arg_SOURCES)
    add_library(${target} ${arg_SOURCES})
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS ${arg_BASE_DIR} FILES ${arg_HEADERS})
    hooke_common(${target})
  else()
    add_library(${target} INTERFACE)
    target_sources(${target} INTERFACE FILE_SET HEADERS BASE_DIRS ${arg_BASE_DIR} FILES ${arg_HEADERS})
  endif()
  add_library(hooke::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} VERIFY_INTERFACE_HEADER_SETS ON
                                             POSITION_INDEPENDENT_CODE ON)
  install(TARGETS ${target} EXPORT hooke-targets FILE_SET HEADERS)
endfunction()
