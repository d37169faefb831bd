# The client core as WebAssembly, built from the sources of the native core with Debian's clang for wasm32.
# Targets: clothstream_core_wasm is the module of the page and uses WebAssembly's SIMD. clothstream_core_wasm_scalar is
# the same without SIMD, for tests only. The global properties CLOTHSTREAM_CORE_WASM and CLOTHSTREAM_CORE_WASM_SCALAR
# hold their paths. These modules import nothing. They export their memory, _initialize, malloc, free and the functions
# of clients/core/core.h. clothstream_recording_wasm is the core with clients/recording, for programs that read
# recordings; it imports two functions of the host (clients/recording/wasm). CLOTHSTREAM_RECORDING_WASM holds its path.
find_program(WASM_CXX clang++ REQUIRED)
find_program(WASM_LD wasm-ld REQUIRED)

set(wasmOut ${PROJECT_BINARY_DIR}/web-wasm)
# Only SIMDe is taken from Debian's include folder: its other headers are for the build machine.
find_path(SIMDE_INCLUDE simde/x86/sse2.h REQUIRED)
file(MAKE_DIRECTORY ${wasmOut}/include)
file(CREATE_LINK ${SIMDE_INCLUDE}/simde ${wasmOut}/include/simde SYMBOLIC)
set(wasmFlags --target=wasm32-wasi -O3 -DNDEBUG -ffp-contract=off -fvisibility=hidden -isystem ${wasmOut}/include -std=c++20
  -fno-rtti -fno-exceptions -Wall -Wextra -Wconversion -Wshadow ${CLOTHSTREAM_WERROR_FLAG} -I${PROJECT_SOURCE_DIR})

# clothstream_wasm_exports(RESULT PART): linker flags that export the functions of a header (PART of interface.json), except
# those that only the native library has.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/clients/interface/interface.json)
function(clothstream_wasm_exports result part)
  file(READ ${PROJECT_SOURCE_DIR}/clients/interface/interface.json interface)
  string(JSON functions GET "${interface}" ${part} functions)
  string(JSON native GET "${interface}" ${part} native)
  string(JSON count LENGTH "${functions}")
  math(EXPR last "${count} - 1")
  set(exports)
  foreach(i RANGE ${last})
    string(JSON name MEMBER "${functions}" ${i})
    if(NOT native MATCHES "\"${name}\"")
      list(APPEND exports -Wl,--export=${name})
    endif()
  endforeach()
  set(${result} ${exports} PARENT_SCOPE)
endfunction()
clothstream_wasm_exports(coreExports core)
list(APPEND coreExports -Wl,--export=malloc -Wl,--export=free)
set_property(GLOBAL PROPERTY CLOTHSTREAM_CORE_EXPORTS ${coreExports})

set_property(GLOBAL PROPERTY CLOTHSTREAM_WASM_FLAGS ${wasmFlags})

# clothstream_link_wasm(MODULE SOURCES file... FLAGS flag... EXPORTS linker flag...) builds the file MODULE. Objects go to
# its folder. As in native builds (CMAKE_UNITY_BUILD), a few units include all sources, so that each header is read a few
# times instead of fifty.
function(clothstream_link_wasm module)
  cmake_parse_arguments(ARG "" "" "SOURCES;FLAGS;EXPORTS" ${ARGN})
  get_property(flags GLOBAL PROPERTY CLOTHSTREAM_WASM_FLAGS)
  get_filename_component(folder ${module} DIRECTORY)
  get_filename_component(moduleName ${module} NAME_WE)
  set(unitSize 1)
  if(CMAKE_UNITY_BUILD)
    set(unitSize 16)
  endif()
  set(objects)
  set(number 0)
  list(LENGTH ARG_SOURCES count)
  math(EXPR last "${count} - 1")
  foreach(begin RANGE 0 ${last} ${unitSize})
    list(SUBLIST ARG_SOURCES ${begin} ${unitSize} sources)
    list(TRANSFORM sources REPLACE "(.+)" "#include \"\\1\"\n" OUTPUT_VARIABLE includes)
    list(JOIN includes "" includes)
    set(unit ${folder}/${moduleName}_${number}.cpp)
    file(CONFIGURE OUTPUT ${unit} CONTENT "@includes@" @ONLY)
    set(object ${unit}.o)
    add_custom_command(OUTPUT ${object}
      COMMAND ${CMAKE_CXX_COMPILER_LAUNCHER} ${WASM_CXX} ${flags} ${ARG_FLAGS} -MMD -MF ${object}.d -c -o ${object} ${unit}
      DEPENDS ${unit} ${sources} DEPFILE ${object}.d COMMENT "Compiling part ${number} of ${moduleName} to WebAssembly" VERBATIM)
    list(APPEND objects ${object})
    math(EXPR number "${number} + 1")
  endforeach()
  add_custom_command(OUTPUT ${module}
    COMMAND ${WASM_CXX} --target=wasm32-wasi -mexec-model=reactor -O3 -Wl,--strip-all -Wl,--gc-sections
      -Wl,-z,stack-size=262144 ${ARG_EXPORTS} -o ${module} ${objects}
    DEPENDS ${objects} COMMENT "Linking ${moduleName}" VERBATIM)
endfunction()

# clothstream_wasm_module(FOLDER PROPERTY flags...) builds FOLDER/clothstream_core.wasm and stores its path in PROPERTY.
function(clothstream_wasm_module folder property)
  get_property(decoderSources GLOBAL PROPERTY CLOTHSTREAM_DECODER_SOURCES)
  get_property(coreSources GLOBAL PROPERTY CLOTHSTREAM_CLIENT_CORE_SOURCES)
  get_property(datagramSources GLOBAL PROPERTY CLOTHSTREAM_DATAGRAM_SOURCES)
  set(module ${folder}/clothstream_core.wasm)
  clothstream_link_wasm(${module} FLAGS ${ARGN} EXPORTS ${coreExports}
    SOURCES ${coreSources} ${datagramSources} ${decoderSources} ${PROJECT_SOURCE_DIR}/clients/core/wasm/runtime.cpp)
  set_property(GLOBAL PROPERTY ${property} ${module})
endfunction()

clothstream_wasm_module(${wasmOut} CLOTHSTREAM_CORE_WASM -msimd128)
get_property(vectorModule GLOBAL PROPERTY CLOTHSTREAM_CORE_WASM)
add_custom_target(clothstream_core_wasm ALL DEPENDS ${vectorModule})
if(CLOTHSTREAM_TESTS)
  clothstream_wasm_module(${wasmOut}/scalar CLOTHSTREAM_CORE_WASM_SCALAR)
  get_property(scalarModule GLOBAL PROPERTY CLOTHSTREAM_CORE_WASM_SCALAR)
  add_custom_target(clothstream_core_wasm_scalar ALL DEPENDS ${scalarModule})
endif()

# Called when clients/recording is configured.
function(clothstream_recording_wasm)
  get_property(coreExports GLOBAL PROPERTY CLOTHSTREAM_CORE_EXPORTS)
  foreach(part CLIENT_CORE CLIENT_RECORDING DATAGRAM RECORDING_READER DECODER)
    get_property(sources GLOBAL PROPERTY CLOTHSTREAM_${part}_SOURCES)
    list(APPEND recordingSources ${sources})
  endforeach()
  clothstream_wasm_exports(recordingExports recording)
  set(module ${PROJECT_BINARY_DIR}/web-wasm/recording/clothstream_recording.wasm)
  clothstream_link_wasm(${module} FLAGS -msimd128 -I${PROJECT_BINARY_DIR}/include
    EXPORTS ${coreExports} ${recordingExports} -Wl,--export=cs_recording_open_host
    SOURCES ${recordingSources} ${PROJECT_SOURCE_DIR}/clients/core/wasm/runtime.cpp)
  add_custom_target(clothstream_recording_wasm ALL DEPENDS ${module})
  set_property(GLOBAL PROPERTY CLOTHSTREAM_RECORDING_WASM ${module})
endfunction()
