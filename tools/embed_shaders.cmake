# Writes OUT, a C++ file that holds the texts of all shaders under SOURCE, so that the library needs no file beside it.
# Usage: cmake -DSOURCE=... -DOUT=... -P embed_shaders.cmake
file(GLOB_RECURSE files RELATIVE ${SOURCE} ${SOURCE}/*)
list(FILTER files EXCLUDE REGEX "[.]md$")
list(SORT files)
set(text "#include \"engine/gpu/shader_texts.h\"\n\nnamespace ballot {\n\nconst ShaderText kShaderTexts[] = {\n")
foreach(file ${files})
  file(READ ${SOURCE}/${file} content)
  string(APPEND text "    {\"${file}\", R\"~~~~(${content})~~~~\"},\n")
endforeach()
list(LENGTH files count)
string(APPEND text "};\nconst std::size_t kShaderTextCount = ${count};\n\n}  // namespace ballot\n")
file(WRITE ${OUT} "${text}")
