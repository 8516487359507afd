# cmake -DINPUT=page.html -DOUTPUT=page.cpp -DNAME=shiftrig::serve::page -DHEADER=apps/serve/page.h -P embed.cmake
# Writes INPUT as a constant into a C++ source.
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "(................................................................)" "\\1\n" bytes "${bytes}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
string(REGEX REPLACE "^(.*)::([^:]+)$" "\\1;\\2" parts ${NAME})
list(GET parts 0 space)
list(GET parts 1 name)
file(WRITE ${OUTPUT} "#include \"${HEADER}\"\nnamespace ${space} {\nstatic const unsigned char bytes[] = {\n${bytes}\n};\n"
  "const std::string_view ${name}(reinterpret_cast<const char*>(bytes), sizeof bytes);\n}\n")
