# kinespace_module(NAME [SOURCES a.cpp ...] [GENERATED a.cpp ...] [DEPENDS target ...] [PRIVATE_DEPENDS target ...])
# makes the library kinespace_NAME of one folder, with the project's warnings, and queues it for installation. Its sources are
# all of the folder and of those below it, but where SOURCES names them; GENERATED: those that the build writes.
# Its headers are included as "kinespace/FOLDER/header.h", here as where they are installed.
set(KINESPACE_MODULES "" CACHE INTERNAL "modules, in the order of the arrows")

set(CMAKE_CXX_EXTENSIONS OFF)
add_library(kinespace_build_flags INTERFACE)
target_compile_options(kinespace_build_flags INTERFACE
  -ffp-contract=off   # the same bits whatever the processor
  -fpch-preprocess)   # lets ccache see through precompiled headers
target_compile_options(kinespace_build_flags INTERFACE
  -Wall -Wextra -Wpedantic $<$<CXX_COMPILER_ID:GNU>:-Wshadow=local> -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast
  -Wno-missing-field-initializers  # designated initialisers leave fields at their defaults on purpose
  $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>  # GCC 12 sees overlaps that are not there in "literal" + std::string (GCC bug 105651)
  $<$<BOOL:${KINESPACE_WERROR}>:-Werror>)
target_link_libraries(kinespace_build_flags INTERFACE fmt::fmt)  # in the shared precompiled header
if(KINESPACE_SANITIZE)
  target_compile_options(kinespace_build_flags INTERFACE -fsanitize=${KINESPACE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(kinespace_build_flags INTERFACE -fsanitize=${KINESPACE_SANITIZE})
  # As GCC says it to the sources; clang 16 has a way of its own.
  foreach(kind address thread)
    string(TOUPPER ${kind} macro)
    if(KINESPACE_SANITIZE MATCHES ${kind})
      target_compile_definitions(kinespace_build_flags INTERFACE $<$<CXX_COMPILER_ID:Clang>:__SANITIZE_${macro}__>)
    endif()
  endforeach()
endif()

# Sources are compiled in batches (a third of the time, a third of the disk): names in anonymous namespaces are unique in
# a folder. -DCMAKE_UNITY_BUILD=OFF compiles them one by one, as scripts/check-tidy does.
if(NOT DEFINED CMAKE_UNITY_BUILD)
  set(CMAKE_UNITY_BUILD ON)
endif()
if(NOT DEFINED CMAKE_UNITY_BUILD_BATCH_SIZE)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)
endif()

set(KINESPACE_INCLUDE ${PROJECT_BINARY_DIR}/include)
file(MAKE_DIRECTORY ${KINESPACE_INCLUDE}/kinespace)
configure_file(${PROJECT_SOURCE_DIR}/include/version.h.in ${KINESPACE_INCLUDE}/kinespace/version.h @ONLY)
set(KINESPACE_HAS_ALGLIB 0)
if(KINESPACE_ALGLIB)
  set(KINESPACE_HAS_ALGLIB 1)
endif()
configure_file(${PROJECT_SOURCE_DIR}/include/licence.h.in ${KINESPACE_INCLUDE}/kinespace/licence.h @ONLY)
file(CREATE_LINK ${PROJECT_SOURCE_DIR}/include/kinespace.h ${KINESPACE_INCLUDE}/kinespace/kinespace.h SYMBOLIC)

# kinespace_folder_sources(OUT): the .cpp files of the current folder and of those below it, in the order of their names.
function(kinespace_folder_sources out)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  list(SORT sources)
  set(${out} ${sources} PARENT_SCOPE)
endfunction()

function(kinespace_module name)
  cmake_parse_arguments(arg "" "" "SOURCES;GENERATED;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  set(target kinespace_${name})
  if(NOT arg_SOURCES)
    kinespace_folder_sources(arg_SOURCES)
  endif()
  get_filename_component(folder ${CMAKE_CURRENT_SOURCE_DIR} NAME)
  file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR} ${KINESPACE_INCLUDE}/kinespace/${folder} SYMBOLIC)
  add_library(${target} STATIC ${arg_SOURCES} ${arg_GENERATED})
  add_library(kinespace::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${KINESPACE_INCLUDE}> $<INSTALL_INTERFACE:include>)
  target_link_libraries(${target} PUBLIC ${arg_DEPENDS} PRIVATE ${arg_PRIVATE_DEPENDS} $<BUILD_INTERFACE:kinespace_build_flags>)
  set(KINESPACE_MODULES ${KINESPACE_MODULES} ${name} CACHE INTERNAL "modules, in the order of the arrows")
endfunction()

# kinespace_precompile(TARGET): the headers that most of our translation units pay for, parsed once for all libraries.
set(KINESPACE_NO_SOURCE ${PROJECT_BINARY_DIR}/generated/none.cpp)
file(CONFIGURE OUTPUT ${KINESPACE_NO_SOURCE} CONTENT "// The owner of a precompiled header must have a source.\n")
add_library(kinespace_precompiled OBJECT ${KINESPACE_NO_SOURCE})
set_target_properties(kinespace_precompiled PROPERTIES POSITION_INDEPENDENT_CODE ON UNITY_BUILD OFF)
target_compile_features(kinespace_precompiled PRIVATE cxx_std_20)
target_link_libraries(kinespace_precompiled PRIVATE kinespace_build_flags Eigen3::Eigen fmt::fmt)
target_precompile_headers(kinespace_precompiled PRIVATE
  <Eigen/Core> <Eigen/Geometry> <fmt/format.h> <algorithm> <cmath> <filesystem> <functional> <map> <memory> <optional>
  <span> <string> <vector>)
function(kinespace_precompile target)
  target_precompile_headers(${target} REUSE_FROM kinespace_precompiled)
endfunction()

# kinespace_list(TARGET FILE MACRO NAME...): writes FILE, a list of `MACRO(NAME)` lines that TARGET includes by path, so that
# a new subcommand or bench is one source file and one name.
function(kinespace_list target file macro)
  list(TRANSFORM ARGN REPLACE "^(.+)$" "${macro}(\\1)\n" OUTPUT_VARIABLE lines)
  string(JOIN "" text ${lines})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/${file} CONTENT "${text}" @ONLY)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>)
endfunction()
