# Writes SOURCE: the text of every scene file in the list FILES, and of every mesh in MESHES, by its name.
set(entries)
set(meshes)
foreach(file IN LISTS MESHES)
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  string(APPEND meshes "    {\"${name}\", R\"obj(${text})obj\"sv},\n")
endforeach()
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME_WE)
  file(READ ${file} text)
  string(APPEND entries "    {\"${name}\", R\"json(${text})json\"sv},\n")
endforeach()
file(WRITE ${SOURCE} "#include \"server/messages/embedded_scenes.h\"

namespace clothstream::messages {

using namespace std::string_view_literals;  // whose length is not counted at compile time

std::span<const EmbeddedScene> embeddedScenes() {
  static constexpr EmbeddedScene kScenes[] = {
${entries}  };
  return kScenes;
}

std::span<const EmbeddedMesh> embeddedMeshes() {
  static constexpr EmbeddedMesh kMeshes[] = {
${meshes}  };
  return kMeshes;
}

}  // namespace clothstream::messages
")
