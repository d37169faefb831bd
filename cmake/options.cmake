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
