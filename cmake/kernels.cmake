# clothstream_add_kernels(TARGET file.comp...): compiles each GLSL kernel to SPIR-V, validates it, and embeds it as
#   #include "kernels/<name>.h"   inline constexpr vulkan::KernelCode clothstream::kernels::<name>
# Kernels include files by their path from the project's root, or relative to their folder.
find_program(GLSLANG glslangValidator REQUIRED)
find_program(SPIRV_VAL spirv-val REQUIRED)

function(clothstream_add_kernels target)
  set(out ${PROJECT_BINARY_DIR}/kernels_generated)
  set(headers)
  foreach(source IN LISTS ARGN)
    get_filename_component(source ${source} ABSOLUTE BASE_DIR ${PROJECT_SOURCE_DIR})
    get_filename_component(name ${source} NAME_WE)
    set(spirv ${out}/spirv/${name}.spv)
    set(header ${out}/kernels/${name}.h)
    add_custom_command(OUTPUT ${spirv}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${out}/spirv
      COMMAND ${GLSLANG} -V --quiet --target-env vulkan1.2 -I${PROJECT_SOURCE_DIR} --depfile ${spirv}.d -o ${spirv} ${source}
      COMMAND ${SPIRV_VAL} --target-env vulkan1.2 ${spirv}
      DEPENDS ${source} DEPFILE ${spirv}.d VERBATIM)
    add_custom_command(OUTPUT ${header}
      COMMAND ${CMAKE_COMMAND} -DSPIRV=${spirv} -DHEADER=${header} -DNAME=${name} -P ${PROJECT_SOURCE_DIR}/cmake/embed_spirv.cmake
      DEPENDS ${spirv} ${PROJECT_SOURCE_DIR}/cmake/embed_spirv.cmake VERBATIM)
    list(APPEND headers ${header})
  endforeach()
  # As sources of `target` alone, kernels would wait until the libraries that it links are built.
  add_custom_target(${target}_kernels DEPENDS ${headers})
  target_sources(${target} PRIVATE ${headers})
  target_include_directories(${target} PRIVATE ${out})
endfunction()
