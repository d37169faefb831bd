# Files and descriptions of the Debian packages.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME clothstream)
set(CPACK_PACKAGE_VENDOR ClothStream)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # each package has its own
set(CPACK_PACKAGE_CONTACT "ClothStream maintainers <maintainers@clothstream.invalid>")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/debian)
set(CPACK_PACKAGE_HOMEPAGE_URL https://clothstream.invalid)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_COMPONENTS_ALL server server_system client client_system library library_system development development_system testing)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/clients/library)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# clothstream_package(GROUP NAME SECTION DEPENDS RECOMMENDS SUMMARY DESCRIPTION)
macro(clothstream_package group name section depends recommends summary description)
  string(TOUPPER ${group} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${depends}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_RECOMMENDS "${recommends}")
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${description}")
endmacro()
set(version ${CLOTHSTREAM_PACKAGE_VERSION})
set(CPACK_DEBIAN_PACKAGE_VERSION ${version})
clothstream_package(server_group clothstream-server net
  "clothstream-client (= ${version}), mesa-vulkan-drivers | vulkan-icd, init-system-helpers (>= 1.52)" ""
  "server that simulates cloth on a GPU and streams it"
  "ClothStream simulates cloth with Vulkan and streams its vertices to clients
for AR and VR, over gRPC and WebSocket. It serves a web page that shows the
cloth. The package starts the server on the loopback addresses.")
clothstream_package(client_group clothstream-client net "" ""
  "command and web page for cloth streams"
  "The command clothstream joins scenes of a ClothStream server, records and
plays them, and converts recordings. The web page shows cloth in a browser
and in headsets; clothstream-server serves it.")
clothstream_package(library_group libclothstream${CLOTHSTREAM_SOVERSION} libs "" ""
  "client library for cloth streams"
  "Programs join scenes of a ClothStream server, receive the positions and
normals of cloth, and send the poses of hands and objects. The interface is C.")
clothstream_package(development_group libclothstream-dev libdevel "libclothstream${CLOTHSTREAM_SOVERSION} (= ${version})" ""
  "headers of the client library for cloth streams"
  "Headers, and files for CMake and pkg-config, of libclothstream. Also fixtures
that read recordings in tests of other programs, and the packages for npm and
Unity.")
if(CLOTHSTREAM_XR)
  list(APPEND CPACK_COMPONENTS_ALL xr xr_system)
  clothstream_package(xr_group clothstream-xr net
    "libclothstream${CLOTHSTREAM_SOVERSION} (= ${version}), libvulkan1, mesa-vulkan-drivers | vulkan-icd, fonts-dejavu-core" ""
    "client for cloth streams in OpenXR headsets"
    "The command clothstream-xr shows scenes of a ClothStream server in a headset
with an OpenXR runtime, such as SteamVR, Monado or WiVRn. Hands and controllers
touch the cloth. Without a headset it opens a window or writes pictures.")
endif()

set(debian ${CMAKE_CURRENT_SOURCE_DIR}/debian)
set(CPACK_DEBIAN_SERVER_GROUP_PACKAGE_CONTROL_EXTRA ${debian}/conffiles ${debian}/postinst ${debian}/prerm ${debian}/postrm)
set(CPACK_DEBIAN_LIBRARY_GROUP_PACKAGE_CONTROL_EXTRA ${debian}/triggers)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY ">=")

include(CPack)
set(groups server client library development)
if(CLOTHSTREAM_XR)
  list(APPEND groups xr)
endif()
foreach(part IN LISTS groups)
  cpack_add_component_group(${part}_group)
  foreach(component ${part} ${part}_system)
    cpack_add_component(${component} GROUP ${part}_group)
  endforeach()
endforeach()
cpack_add_component(testing GROUP development_group)
