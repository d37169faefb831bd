# Changes code that protoc has generated: cmake -D header=FILE.pb.h -P keep_messages_valid.cmake
#
# protoc marks a member of a message as present, and then allocates it. If memory runs out in between, the member of a
# `oneof` is a stale pointer, which the destructor deletes again, and an `optional` member is a null pointer, which others
# read. Here the allocation comes first, so that a message stays valid when memory runs out. In the same way, protobuf
# counts a text that is moved into a `repeated` field before it allocates the text.
file(READ ${header} code)
set(name "[A-Za-z0-9_]+")

# set_has_sphere();
# _impl_.shape_.sphere_ = CreateMaybeMessage< Sphere >(...);
set(mark "set_has_${name}\\(\\);")
set(allocate "_impl_\\.${name}\\.${name} = CreateMaybeMessage<[^;]*;")
string(REGEX REPLACE "(${mark})(\n +)(${allocate})" "\\3\\2\\1" changed "${code}")
if(code MATCHES "enum ${name}Case {" AND changed STREQUAL code)
  message(FATAL_ERROR "${header}: this release of protoc generates other code for oneof; adapt "
    "cmake/keep_messages_valid.cmake to it")
endif()

# _impl_._has_bits_[0] |= 0x00000001u;
# if (_impl_.wind_ == nullptr) {
#   auto* p = CreateMaybeMessage<Vec3Value>(...);
#   _impl_.wind_ = p;
# }
set(mark "  _impl_\\._has_bits_\\[[0-9]+\\] \\|= 0x[0-9a-f]+u;\n")
set(allocate "  if \\(_impl_\\.${name} == nullptr\\) {\n[^;]*CreateMaybeMessage<[^;]*;\n[^;]*;\n  }\n")
string(REGEX REPLACE "(${mark})(${allocate})" "\\2\\1" changed "${changed}")

# _impl_.names_.Add(std::move(value));
string(REGEX REPLACE "(_impl_\\.${name}\\.Add)\\(std::move\\(value\\)\\);" "*\\1() = std::move(value);" changed "${changed}")
file(WRITE ${header} "${changed}")
