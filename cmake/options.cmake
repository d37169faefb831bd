# `clothstream_flags`: warnings, floating-point rules, sanitizers. `clothstream_options`: the same with fmt and spdlog; every
# target of ours links it. The sources of libclothstream use neither.
option(CLOTHSTREAM_WERROR "Treat warnings as errors, as .ci/run does. Other compilers have other warnings" OFF)
set(CLOTHSTREAM_WERROR_FLAG "")
if(CLOTHSTREAM_WERROR AND NOT CLOTHSTREAM_SANITIZE) # gcc gives false warnings in instrumented code
  set(CLOTHSTREAM_WERROR_FLAG -Werror)
endif()
add_library(clothstream_flags INTERFACE)
add_library(clothstream_options INTERFACE)
target_link_libraries(clothstream_options INTERFACE clothstream_flags)
if(NOT CLOTHSTREAM_CLIENT_ONLY)
  target_link_libraries(clothstream_options INTERFACE clothstream_formatting)
endif()
target_include_directories(clothstream_flags INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(clothstream_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wnon-virtual-dtor -Wold-style-cast
  ${CLOTHSTREAM_WERROR_FLAG}
  # These warnings of gcc depend on what it inlines, and are often false.
  $<$<AND:$<BOOL:${CLOTHSTREAM_WERROR}>,$<CXX_COMPILER_ID:GNU>>:-Wno-error=maybe-uninitialized;-Wno-error=stringop-overflow;-Wno-error=array-bounds>
  $<$<AND:$<BOOL:${CMAKE_UNITY_BUILD}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage> # unity sources
  -ffp-contract=off)
if(WIN32)
  # Windows 10 or later; no macros named min and max, and no headers that few programs need.
  target_compile_definitions(clothstream_flags INTERFACE _WIN32_WINNT=0x0A00 NOMINMAX WIN32_LEAN_AND_MEAN)
endif()
if(CLOTHSTREAM_SANITIZE)
  target_compile_options(clothstream_flags INTERFACE -fsanitize=${CLOTHSTREAM_SANITIZE}
    -fno-sanitize=null,vptr,object-size # they take a third of the compile time, and the address sanitizer finds the same
    -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(clothstream_flags INTERFACE -fsanitize=${CLOTHSTREAM_SANITIZE})
  if(CLOTHSTREAM_SANITIZE STREQUAL thread)
    # The thread sanitizer ignores Asio's fences, which only order what Asio's locks already order.
    target_compile_options(clothstream_flags INTERFACE -Wno-tsan)
  else()
    add_library(clothstream_keep_loaded OBJECT ${PROJECT_SOURCE_DIR}/tests/keep_loaded.cpp)
    target_link_libraries(clothstream_flags INTERFACE $<TARGET_OBJECTS:clothstream_keep_loaded>)
  endif()
endif()

# clothstream_compile_lightly(TARGET): for code that spends its time in other rooms or in the operating system. It is
# compiled with the precompiled header of cmake/libraries and, in Release, with -O1: together half of the time of -O3.
function(clothstream_compile_lightly target)
  if(NOT MSVC)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
  if(TARGET clothstream_header)
    target_precompile_headers(${target} REUSE_FROM clothstream_header)
    # The header is only valid with the options with which it was compiled. gRPC and Avahi require -pthread.
    target_compile_options(${target} PRIVATE -pthread $<$<STREQUAL:$<TARGET_PROPERTY:${target},TYPE>,EXECUTABLE>:-fPIC>)
    target_link_libraries(${target} PRIVATE clothstream_header_use)
  endif()
endfunction()

# clothstream_library(NAME [ARITHMETIC] sources...): a static library of ours with the common options. ARITHMETIC: its loops
# over vertices are worth the compiler's full optimisation.
function(clothstream_library name)
  cmake_parse_arguments(ARG "ARITHMETIC" "" "" ${ARGN})
  add_library(${name} STATIC ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PUBLIC clothstream_options)
  if(NOT ARG_ARITHMETIC)
    clothstream_compile_lightly(${name})
  endif()
endfunction()
