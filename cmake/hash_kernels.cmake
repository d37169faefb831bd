# Writes a hash of KERNELS, which are headers that embed_spirv.cmake wrote, to the C++ header HEADER.
set(hashes "")
foreach(kernel IN LISTS KERNELS)
  file(SHA256 ${kernel} hash)
  string(APPEND hashes ${hash})
endforeach()
string(SHA256 hash "${hashes}")
string(SUBSTRING ${hash} 0 16 hash)
file(WRITE ${HEADER} "#pragma once
namespace clothstream::kernels {
inline constexpr const char* kShaderHash = \"${hash}\";
}
")
