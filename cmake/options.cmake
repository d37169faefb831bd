# `clothstream_flags`: warnings, floating-point rules, sanitizers. `clothstream_options`: the same with fmt and spdlog; every
# target of ours links it.
add_library(clothstream_flags INTERFACE)
add_library(clothstream_options INTERFACE)
target_link_libraries(clothstream_options INTERFACE clothstream_flags clothstream_formatting)
target_include_directories(clothstream_flags INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(clothstream_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Werror
  $<$<AND:$<BOOL:${CMAKE_UNITY_BUILD}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage> # sources are compiled as one
  -ffp-contract=off)
if(CLOTHSTREAM_SANITIZE)
  target_compile_options(clothstream_flags INTERFACE -fsanitize=${CLOTHSTREAM_SANITIZE}
    -fno-sanitize=null,vptr,object-size # a third of the compiler's time, for what the address sanitizer finds
    -fno-sanitize-recover=all -fno-omit-frame-pointer
    -Wno-error) # gcc sees what is not there in what sanitizers add
  target_link_options(clothstream_flags INTERFACE -fsanitize=${CLOTHSTREAM_SANITIZE})
  if(CLOTHSTREAM_SANITIZE STREQUAL thread)
    # Asio's fences are not seen by the thread sanitizer; they order what its locks order already.
    target_compile_options(clothstream_flags INTERFACE -Wno-tsan)
  else()
    add_library(clothstream_keep_loaded OBJECT ${PROJECT_SOURCE_DIR}/tests/keep_loaded.cpp)
    target_link_libraries(clothstream_flags INTERFACE $<TARGET_OBJECTS:clothstream_keep_loaded>)
  endif()
endif()

# clothstream_library(NAME sources...): a static library of ours with the common options.
function(clothstream_library name)
  add_library(${name} STATIC ${ARGN})
  target_link_libraries(${name} PUBLIC clothstream_options)
endfunction()

# What drivers and layers do is not ours to mend.
set(CLOTHSTREAM_SANITIZER_ENVIRONMENT "")
if(CLOTHSTREAM_SANITIZE STREQUAL thread)
  set(CLOTHSTREAM_SANITIZER_ENVIRONMENT "TSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/tsan.supp")
elseif(CLOTHSTREAM_SANITIZE)
  set(CLOTHSTREAM_SANITIZER_ENVIRONMENT "LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/lsan.supp")
endif()

# clothstream_test(NAME LABELS label... SOURCES file... LIBRARIES target...): a GoogleTest program whose every
# test is one ctest with those labels.
function(clothstream_test name)
  cmake_parse_arguments(ARG "" "" "LABELS;SOURCES;LIBRARIES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE clothstream_options ${ARG_LIBRARIES} GTest::gtest GTest::gmock GTest::gtest_main)
  # Lists do not survive as PROPERTIES of gtest_discover_tests: what it found gets them in a file of its own.
  set(properties ${CMAKE_CURRENT_BINARY_DIR}/${name}_properties.cmake)
  set(environment ${CLOTHSTREAM_SANITIZER_ENVIRONMENT})
  if("gpu" IN_LIST ARG_LABELS)
    list(APPEND environment "CLOTHSTREAM_VALIDATION=1")
  endif()
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST DISCOVERY_TIMEOUT 60 WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  file(WRITE ${properties} "foreach(test IN LISTS ${name}_TESTS)
  set_tests_properties(\${test} PROPERTIES LABELS \"${ARG_LABELS}\" ENVIRONMENT \"${environment}\" TIMEOUT 300)
endforeach()
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${properties})
endfunction()
