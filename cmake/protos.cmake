# Libraries: clothstream_protos holds the messages, clothstream_protos_grpc also our gRPC service, and
# clothstream_protos_health and clothstream_protos_reflection those of gRPC. Generated sources are in <build>/proto_generated.
find_package(Protobuf REQUIRED)
set(protoOut ${PROJECT_BINARY_DIR}/proto_generated)
set(protoNames fleet recording saved_state scene session)
set(messageSources)
foreach(name IN LISTS protoNames)
  set(source ${PROJECT_SOURCE_DIR}/proto/clothstream/v1/${name}.proto)
  set(stem ${protoOut}/clothstream/v1/${name})
  add_custom_command(OUTPUT ${stem}.pb.cc ${stem}.pb.h
    COMMAND ${CMAKE_COMMAND} -E make_directory ${protoOut}
    COMMAND protobuf::protoc -I${PROJECT_SOURCE_DIR}/proto --cpp_out=${protoOut} ${source}
    DEPENDS ${PROJECT_SOURCE_DIR}/proto/clothstream/v1/scene.proto ${PROJECT_SOURCE_DIR}/proto/clothstream/v1/session.proto
      ${PROJECT_SOURCE_DIR}/proto/clothstream/v1/recording.proto ${source} VERBATIM)
  list(APPEND messageSources ${stem}.pb.cc ${stem}.pb.h)
endforeach()
add_library(clothstream_protos STATIC ${messageSources})
set_target_properties(clothstream_protos PROPERTIES UNITY_BUILD OFF) # generated files repeat names
target_compile_options(clothstream_protos PRIVATE $<$<CONFIG:Release>:-O1>) # half of the time of -O3
target_include_directories(clothstream_protos SYSTEM PUBLIC ${protoOut})
# Programs with the property CLOTHSTREAM_STATIC_PROTOBUF link protobuf statically. They cannot use gRPC, which links the
# shared library.
find_library(CLOTHSTREAM_PROTOBUF_ARCHIVE libprotobuf.a REQUIRED)
target_link_libraries(clothstream_protos PUBLIC
  $<IF:$<BOOL:$<TARGET_PROPERTY:CLOTHSTREAM_STATIC_PROTOBUF>>,${CLOTHSTREAM_PROTOBUF_ARCHIVE},protobuf::libprotobuf>)

if(CLOTHSTREAM_RPC)
  find_package(gRPC CONFIG REQUIRED)
  # In Debian 13 the options of RE2, which gRPC links, are those of Abseil on Windows: -DNOMINMAX. Precompiled headers are not
  # valid with it.
  set_property(TARGET re2::re2 PROPERTY INTERFACE_COMPILE_OPTIONS)
  if(gRPC_VERSION VERSION_LESS 1.60)
    message(STATUS "gRPC ${gRPC_VERSION} has published weaknesses (SECURITY.md): do not let the server's gRPC port face the open "
      "internet")
  endif()
  set(generateService --grpc_out=${protoOut} --plugin=protoc-gen-grpc=$<TARGET_FILE:gRPC::grpc_cpp_plugin>)
  set(stem ${protoOut}/clothstream/v1/session)
  add_custom_command(OUTPUT ${stem}.grpc.pb.cc ${stem}.grpc.pb.h
    COMMAND protobuf::protoc -I${PROJECT_SOURCE_DIR}/proto ${generateService}
      ${PROJECT_SOURCE_DIR}/proto/clothstream/v1/session.proto
    DEPENDS ${PROJECT_SOURCE_DIR}/proto/clothstream/v1/session.proto
      ${PROJECT_SOURCE_DIR}/proto/clothstream/v1/scene.proto VERBATIM)
  add_library(clothstream_protos_grpc STATIC ${stem}.grpc.pb.cc ${stem}.grpc.pb.h)
  target_link_libraries(clothstream_protos_grpc PUBLIC clothstream_protos gRPC::grpc++)

  foreach(service health/v1/health reflection/v1alpha/reflection)
    set(stem ${protoOut}/grpc/${service})
    set(source ${PROJECT_SOURCE_DIR}/proto/grpc/${service}.proto)
    add_custom_command(OUTPUT ${stem}.pb.cc ${stem}.pb.h ${stem}.grpc.pb.cc ${stem}.grpc.pb.h
      COMMAND protobuf::protoc -I${PROJECT_SOURCE_DIR}/proto --cpp_out=${protoOut} ${generateService} ${source}
      DEPENDS ${source} VERBATIM)
    get_filename_component(name ${service} NAME)
    add_library(clothstream_protos_${name} STATIC ${stem}.pb.cc ${stem}.pb.h ${stem}.grpc.pb.cc ${stem}.grpc.pb.h)
    set_target_properties(clothstream_protos_${name} PROPERTIES UNITY_BUILD OFF)
    target_include_directories(clothstream_protos_${name} SYSTEM PUBLIC ${protoOut})
    target_link_libraries(clothstream_protos_${name} PUBLIC protobuf::libprotobuf gRPC::grpc++)
  endforeach()
endif()
