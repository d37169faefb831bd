# clothstream_core_wasm: the client core as WebAssembly, built from the native core's sources with Debian's clang for
# wasm32. The global property CLOTHSTREAM_CORE_WASM holds the module's path, CLOTHSTREAM_CORE_WASM_SCALAR that of one
# without WebAssembly's vectors, which the tests compare. Modules import nothing and export their memory, _initialize,
# malloc, free and the functions of clients/core/core.h.
find_program(WASM_CXX NAMES clang++ clang++-14 REQUIRED)
find_program(WASM_LD NAMES wasm-ld wasm-ld-14 REQUIRED)

set(wasmOut ${PROJECT_BINARY_DIR}/web-wasm)
# SIMDe alone of what Debian's include folder has: the rest is for the machine that builds.
find_path(SIMDE_INCLUDE simde/x86/sse2.h REQUIRED)
file(MAKE_DIRECTORY ${wasmOut}/include)
file(CREATE_LINK ${SIMDE_INCLUDE}/simde ${wasmOut}/include/simde SYMBOLIC)
set(wasmFlags --target=wasm32-wasi -O3 -DNDEBUG -ffp-contract=off -fvisibility=hidden -isystem ${wasmOut}/include -std=c++20
  -fno-rtti -fno-exceptions -Wall -Wextra -Wconversion -Wshadow -Werror -I${PROJECT_SOURCE_DIR})

# All functions that core.h declares, but the one that takes a function of the caller's.
set(coreHeader ${PROJECT_SOURCE_DIR}/clients/core/core.h)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${coreHeader})
file(READ ${coreHeader} coreText)
string(REGEX MATCHALL "cs_[a-z_]+\\(" wasmExports "${coreText}")
list(TRANSFORM wasmExports REPLACE "\\($" "")
list(REMOVE_ITEM wasmExports cs_set_clock)
list(APPEND wasmExports malloc free)
list(TRANSFORM wasmExports PREPEND -Wl,--export=)

# clothstream_wasm_module(FOLDER PROPERTY flags...): FOLDER/clothstream_core.wasm, whose path PROPERTY then holds.
function(clothstream_wasm_module folder property)
  get_property(decoderSources GLOBAL PROPERTY CLOTHSTREAM_DECODER_SOURCES)
  set(objects)
  foreach(source IN LISTS CLOTHSTREAM_CLIENT_CORE_SOURCES decoderSources ITEMS
      ${PROJECT_SOURCE_DIR}/clients/core/wasm/runtime.cpp)
    get_filename_component(name ${source} NAME)
    set(object ${folder}/${name}.o)
    add_custom_command(OUTPUT ${object}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${folder}
      COMMAND ${CMAKE_CXX_COMPILER_LAUNCHER} ${WASM_CXX} ${wasmFlags} ${ARGN} -MMD -MF ${object}.d -c -o ${object} ${source}
      DEPENDS ${source} DEPFILE ${object}.d COMMENT "Compiling ${name} to WebAssembly" VERBATIM)
    list(APPEND objects ${object})
  endforeach()
  set(module ${folder}/clothstream_core.wasm)
  add_custom_command(OUTPUT ${module}
    COMMAND ${WASM_CXX} --target=wasm32-wasi -mexec-model=reactor -O3 -Wl,--strip-all -Wl,--gc-sections
      -Wl,-z,stack-size=262144 ${wasmExports} -o ${module} ${objects}
    DEPENDS ${objects} COMMENT "Linking the client core as WebAssembly" VERBATIM)
  set_property(GLOBAL PROPERTY ${property} ${module})
endfunction()

clothstream_wasm_module(${wasmOut} CLOTHSTREAM_CORE_WASM -msimd128)
clothstream_wasm_module(${wasmOut}/scalar CLOTHSTREAM_CORE_WASM_SCALAR)
get_property(vectorModule GLOBAL PROPERTY CLOTHSTREAM_CORE_WASM)
get_property(scalarModule GLOBAL PROPERTY CLOTHSTREAM_CORE_WASM_SCALAR)
add_custom_target(clothstream_core_wasm ALL DEPENDS ${vectorModule} ${scalarModule})
