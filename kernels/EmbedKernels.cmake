# Turns kernels/x.cl into the C++ string opencl_source::x, so that the library needs no file at run time.
# cmake -DNAME=x -DINPUT=x.cl -DOUTPUT=x_cl.cpp -P EmbedKernels.cmake
if(CMAKE_SCRIPT_MODE_FILE)
  file(READ "${INPUT}" source)
  get_filename_component(folder "${INPUT}" DIRECTORY)
  while(source MATCHES "#include \"([a-z_]+\\.cl)\"\n")
    set(line "${CMAKE_MATCH_0}")
    file(READ "${folder}/${CMAKE_MATCH_1}" included)
    string(REPLACE "${line}" "${included}" source "${source}")
  endwhile()
  file(WRITE "${OUTPUT}" "// Made from kernels/${NAME}.cl.
namespace kinespace::opencl_source {
extern const char* const ${NAME};
const char* const ${NAME} = R\"opencl(${source})opencl\";
}  // namespace kinespace::opencl_source
")
  return()
endif()

# kinespace_embed_kernels(VARIABLE): the list of generated sources, one for each .cl of the folder but for the tiles, which others include.
set(KINESPACE_EMBED_SCRIPT "${CMAKE_CURRENT_LIST_FILE}")
function(kinespace_embed_kernels variable)
  set(outputs "")
  set(common "${CMAKE_CURRENT_SOURCE_DIR}/matrix_tile.cl")  # what kernels include
  file(GLOB inputs CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cl")
  list(FILTER inputs EXCLUDE REGEX "_tile\\.cl$")
  foreach(input IN LISTS inputs)
    get_filename_component(name "${input}" NAME_WE)
    set(output "${CMAKE_CURRENT_BINARY_DIR}/${name}_cl.cpp")
    add_custom_command(
      OUTPUT "${output}"
      COMMAND "${CMAKE_COMMAND}" -DNAME=${name} "-DINPUT=${input}" "-DOUTPUT=${output}" -P "${KINESPACE_EMBED_SCRIPT}"
      DEPENDS "${input}" ${common} "${KINESPACE_EMBED_SCRIPT}"
      VERBATIM)
    list(APPEND outputs "${output}")
  endforeach()
  set(${variable} "${outputs}" PARENT_SCOPE)
endfunction()
