# macOS 13.3 and later, for the processor of the Mac that builds, with Xcode and Homebrew:
#   cmake -G Ninja -B build/macos -DCMAKE_TOOLCHAIN_FILE=cmake/toolchains/macos.cmake -DCLOTHSTREAM_CLIENT_ONLY=ON
# Never tried: docs/client-library.md.
set(CMAKE_OSX_DEPLOYMENT_TARGET 13.3) # the first whose library writes and reads numbers (std::to_chars) for double
list(APPEND CMAKE_PREFIX_PATH /opt/homebrew /opt/homebrew/opt/openssl@3 /usr/local /usr/local/opt/openssl@3)
