# Writes the binary SPIRV as the vulkan::KernelCode clothstream::kernels::NAME to the C++ header HEADER.
file(READ ${SPIRV} bytes HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
string(REGEX REPLACE "(0x........,0x........,0x........,0x........,0x........,0x........,0x........,0x........,)" "\\1\n" words "${words}")
file(WRITE ${HEADER} "#pragma once
#include <cstdint>
#include \"server/vulkan/kernel.h\"
namespace clothstream::kernels {
inline constexpr std::uint32_t ${NAME}_words[] = {
${words}
};
inline constexpr vulkan::KernelCode ${NAME}{\"${NAME}\", ${NAME}_words};
}
")
