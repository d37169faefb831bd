# clothstream_test: test programs, their common compiler options and their environment.
enable_testing()
find_package(GTest REQUIRED)

# Warnings about drivers and layers that are suppressed: this project cannot fix them.
set(CLOTHSTREAM_SANITIZER_ENVIRONMENT "")
if(CLOTHSTREAM_SANITIZE STREQUAL thread)
  set(CLOTHSTREAM_SANITIZER_ENVIRONMENT "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/tsan.supp")
elseif(CLOTHSTREAM_SANITIZE)
  set(CLOTHSTREAM_SANITIZER_ENVIRONMENT "LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/lsan.supp")
endif()

# Every test program reuses this precompiled header, so all are compiled with -pthread, which gRPC requires. Tests are
# compiled with -O1, in two thirds of the time of -O3. Libraries with ARITHMETIC (cmake/options.cmake) keep -O3.
add_executable(clothstream_test_header EXCLUDE_FROM_ALL ${PROJECT_SOURCE_DIR}/cmake/libraries/testing.cpp)
target_link_libraries(clothstream_test_header PRIVATE clothstream_header_libraries GTest::gtest GTest::gmock GTest::gtest_main)
target_compile_options(clothstream_test_header PRIVATE -pthread $<$<CONFIG:Release>:-O1>)
target_precompile_headers(clothstream_test_header PRIVATE <gmock/gmock.h> <gtest/gtest.h>
  $<$<BOOL:${CMAKE_UNITY_BUILD}>:${PROJECT_SOURCE_DIR}/cmake/libraries/precompiled.h>)

# Tests of three tiers. `./dev test` runs the first, which shows within minutes whether everything works. `thorough` is
# the second, at larger sizes and with more scenes, and `long` the third, with other platforms and runs of many minutes.
# A test of a later tier has its label. The target quick_tests is what the first tier needs, `all` what all need, and
# tests_of_LABEL builds all test programs with a label.
add_custom_target(quick_tests)

# clothstream_test(NAME LABELS label... SOURCES file... LIBRARIES target... THOROUGH pattern... QUICK pattern...
# EXCEPT pattern): adds a GoogleTest program. Each of its suites is one ctest test with these labels
# (cmake/add_suites.cmake); the label `gpu` switches Vulkan validation on. Suites and single tests (SUITE.TEST, with
# wildcards) after THOROUGH take long, and have the label `thorough`, too; those after QUICK have not. Suites leave out
# the single tests whose names match EXCEPT.
function(clothstream_test name)
  cmake_parse_arguments(ARG "" "EXCEPT" "LABELS;SOURCES;LIBRARIES;THOROUGH;QUICK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE clothstream_options ${ARG_LIBRARIES} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_options(${name} PRIVATE -pthread $<$<CONFIG:Release>:-O1>)
  target_precompile_headers(${name} REUSE_FROM clothstream_test_header)
  target_link_libraries(${name} PRIVATE clothstream_header_use)
  set(environment ${CLOTHSTREAM_SANITIZER_ENVIRONMENT})
  if("gpu" IN_LIST ARG_LABELS)
    list(APPEND environment "CLOTHSTREAM_VALIDATION=1")
  endif()
  if(NOT ARG_LABELS MATCHES "thorough|long")
    add_dependencies(quick_tests ${name})
  endif()
  foreach(label IN LISTS ARG_LABELS)
    if(NOT TARGET tests_of_${label})
      add_custom_target(tests_of_${label})
    endif()
    add_dependencies(tests_of_${label} ${name})
  endforeach()
  set(suites ${CMAKE_CURRENT_BINARY_DIR}/${name}_suites.cmake)
  file(GENERATE OUTPUT ${suites} CONTENT "set(name ${name})
set(program $<TARGET_FILE:${name}>)
set(directory ${PROJECT_SOURCE_DIR})
set(labels \"${ARG_LABELS}\")
set(thorough \"${ARG_THOROUGH}\")
set(quick \"${ARG_QUICK}\")
set(except \"${ARG_EXCEPT}\")
set(environment \"${environment}\")
include(${PROJECT_SOURCE_DIR}/cmake/add_suites.cmake)
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${suites})
endfunction()
