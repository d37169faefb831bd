# Writes SOURCE: the text of every scene file in the list FILES, by its name.
set(entries)
foreach(file IN LISTS FILES)
  get_filename_component(name ${file} NAME_WE)
  file(READ ${file} text)
  string(APPEND entries "    {\"${name}\", R\"json(${text})json\"},\n")
endforeach()
file(WRITE ${SOURCE} "#include \"server/messages/embedded_scenes.h\"

namespace clothstream::messages {

std::span<const EmbeddedScene> embeddedScenes() {
  static constexpr EmbeddedScene kScenes[] = {
${entries}  };
  return kScenes;
}

}  // namespace clothstream::messages
")
