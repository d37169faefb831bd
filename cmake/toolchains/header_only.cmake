# Included by toolchain files: makes a folder with only the header-only libraries that libclothstream needs. Compilers for
# other systems must not see the rest of /usr/include, which describes this machine.
get_property(triesCompiler GLOBAL PROPERTY IN_TRY_COMPILE)
if(triesCompiler)
  return()
endif()

set(headerOnly ${CMAKE_BINARY_DIR}/header_only)
foreach(folder include/boost include/protozero include/simde include/tl share/cmake/tl-expected)
  if(NOT EXISTS /usr/${folder})
    message(FATAL_ERROR "/usr/${folder} is missing: apt install libboost-dev libexpected-dev libprotozero-dev libsimde-dev")
  endif()
  get_filename_component(parent ${headerOnly}/${folder} DIRECTORY)
  file(MAKE_DIRECTORY ${parent})
  file(CREATE_LINK /usr/${folder} ${headerOnly}/${folder} SYMBOLIC)
endforeach()

list(APPEND CMAKE_FIND_ROOT_PATH ${headerOnly})
list(APPEND CMAKE_PREFIX_PATH ${headerOnly})
# Debian's CMake files of Boost would add /usr/include.
set(Boost_NO_BOOST_CMAKE ON)
