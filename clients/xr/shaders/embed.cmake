# Writes the binary SPIRV as the words clothstream::xr::shaders::NAME to the C++ header HEADER.
file(READ ${SPIRV} bytes HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
string(REGEX REPLACE "(0x........,0x........,0x........,0x........,0x........,0x........,0x........,0x........,)" "\\1\n" words "${words}")
file(WRITE ${HEADER} "#pragma once
#include <cstdint>
namespace clothstream::xr::shaders {
inline constexpr std::uint32_t ${NAME}[] = {
${words}
};
}
")
