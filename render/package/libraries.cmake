# What the four libraries have in common: names, what their users see, and the headers that are public.
#
# Private headers are those in the source folders. Public ones are copied to include/flexframe/ of the build folder, from where they are
# installed, with their includes written as <flexframe/...>: users never see the repository's root. Public are the doors listed here and
# what they include; tests/packaging looks that each is documented.
set(FLEXFRAME_DOORS_sim
  sim/base/error.h sim/simulate.h sim/simulation.h sim/scene/scene_reader.h sim/results/results.h sim/results/results_file.h
  sim/results/csv.h sim/results/histories.h sim/run/effect_report.h sim/reduce/reduce.h sim/reduce/reduce_request.h sim/bodies/sid.h)
set(FLEXFRAME_DOORS_interp interp/map.h interp/modes.h interp/exaggerate.h interp/watch.h)
set(FLEXFRAME_DOORS_render
  render/picture/picture.h render/picture/mesh.h render/picture/shapes.h render/draw/renderer.h render/image/image.h render/image/png.h
  render/image/image_compare.h render/frame/camera.h)
set(FLEXFRAME_DOORS_film
  render/film/settings.h render/film/animation.h render/film/filming.h render/film/video.h render/film/gltf.h render/film/vtk.h
  render/film/study.h)

set(FLEXFRAME_PUBLIC_FOLDER ${PROJECT_BINARY_DIR}/include)

# Programs and modules name only the libraries whose functions they call: the lists of HDF5 and assimp hold others too, on which packages
# would depend.
if(NOT APPLE)
  target_link_options(flexframe_options INTERFACE LINKER:--as-needed)
endif()

# flexframe_publish(HEADER): it and what it includes, to the public folder.
function(flexframe_publish header)
  get_property(done GLOBAL PROPERTY flexframe_published)
  if(header IN_LIST done)
    return()
  endif()
  set_property(GLOBAL APPEND PROPERTY flexframe_published ${header})
  file(READ ${PROJECT_SOURCE_DIR}/${header} text)
  string(REGEX MATCHALL "#include \"[^\"]+\"" includes "${text}")
  string(REGEX REPLACE "#include \"([^\"]+)\"" "#include <flexframe/\\1>" text "${text}")
  file(CONFIGURE OUTPUT ${FLEXFRAME_PUBLIC_FOLDER}/flexframe/${header} CONTENT "${text}" @ONLY)
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${header})
  foreach(include ${includes})
    string(REGEX REPLACE "#include \"([^\"]+)\"" "\\1" include ${include})
    flexframe_publish(${include})
  endforeach()
endfunction()

# flexframe_library(MODULE SOURCE...): flexframe::MODULE, static or shared (BUILD_SHARED_LIBS).
function(flexframe_library module)
  set(target flexframe_${module})
  add_library(${target} ${ARGN})
  add_library(flexframe::${module} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${module} VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
  target_compile_features(${target} PUBLIC cxx_std_20)
  # The project's own programs and tests take its rules from the libraries; others do not.
  if(PROJECT_IS_TOP_LEVEL)
    target_link_libraries(${target} PUBLIC $<BUILD_INTERFACE:flexframe_options>)
  else()
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:flexframe_options>)
  endif()
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${FLEXFRAME_PUBLIC_FOLDER}> $<INSTALL_INTERFACE:include>)
  if(BUILD_SHARED_LIBS)
    # Only what is Flexframe's is to be seen: what it makes of Eigen's and fmt's templates is not. No source asks which kind it is for, so
    # both kinds are made of the same objects; calls within a library go straight to the function.
    target_link_options(${target} PRIVATE LINKER:--version-script=${PROJECT_SOURCE_DIR}/render/package/symbols.map
      LINKER:-Bsymbolic-functions)
    set_target_properties(${target} PROPERTIES LINK_DEPENDS ${PROJECT_SOURCE_DIR}/render/package/symbols.map DEFINE_SYMBOL "")
  endif()
  set(doors "// The public functions of flexframe::${module}.\n#pragma once\n\n")
  foreach(header ${FLEXFRAME_DOORS_${module}})
    flexframe_publish(${header})
    string(APPEND doors "#include <flexframe/${header}>\n")
  endforeach()
  file(CONFIGURE OUTPUT ${FLEXFRAME_PUBLIC_FOLDER}/flexframe/${module}.h CONTENT "${doors}" @ONLY)
endfunction()

# The texts of a folder as a C++ table, file name -> text: function() of namespace flexframe::NAMESPACE, declared in `header`. The source's
# name comes back in `out`.
function(flexframe_embed_texts out folder header namespace function)
  file(GLOB files CONFIGURE_DEPENDS ${folder}/*)
  set(table "")
  foreach(file ${files})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    get_filename_component(name ${file} NAME)
    file(READ ${file} text)
    string(APPEND table "    {\"${name}\", R\"~~(${text})~~\"},\n")
  endforeach()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp)
  file(CONFIGURE OUTPUT ${source} @ONLY CONTENT "#include \"${header}\"
namespace flexframe::${namespace} {
const std::map<std::string, std::string>& ${function}() {
  static const std::map<std::string, std::string> texts{
@table@  };
  return texts;
}
}  // namespace flexframe::${namespace}
")
  set(${out} ${source} PARENT_SCOPE)
endfunction()

file(CONFIGURE OUTPUT ${FLEXFRAME_PUBLIC_FOLDER}/flexframe/version.h CONTENT [[
// The version of the headers, by semantic versioning; flexframe --version tells that of the program.
#pragma once

#define FLEXFRAME_VERSION_MAJOR @PROJECT_VERSION_MAJOR@
#define FLEXFRAME_VERSION_MINOR @PROJECT_VERSION_MINOR@
#define FLEXFRAME_VERSION_PATCH @PROJECT_VERSION_PATCH@
#define FLEXFRAME_VERSION "@PROJECT_VERSION@"
]] @ONLY)
