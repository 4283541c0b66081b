# cpack: Debian packages flexframe, libflexframe-dev and python3-flexframe, and the source as a tarball (cpack --config
# CPackSourceConfig.cmake).
set(CPACK_PACKAGE_NAME flexframe)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "The Flexframe authors <flexframe@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "flexible multibody simulation and its pictures")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_GENERATOR DEB)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL program dev)

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME flexframe)
# What is opened when it is needed, so that no linker knows of it: OSMesa, and the libraries of late.cmake.
flexframe_packages_of(sparse ${OPENBLAS_LIBRARY} ${MUMPS_LIBRARY} ${METIS_LIBRARY})
flexframe_packages_of(foreign_files ${NETCDF_LIBRARY} ${MATIO_LIBRARY} ${LIBZIP_LIBRARY})
string(JOIN ", " opened libosmesa6 fonts-dejavu-core ${sparse})
string(JOIN ", " CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS ${opened} ${foreign_files})
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "ffmpeg")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "A scene file goes in; simulation results, histories and PNG pictures come
out, without a display. Elastic bodies move in a floating frame of
reference; their displacements at few nodes deform dense meshes.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libflexframe-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
  "libeigen3-dev, libglm-dev, libsundials-dev, libfmt-dev, libtomlplusplus-dev, libhdf5-dev, libassimp-dev, libmeshoptimizer-dev, \
libdeflate-dev, libmumps-seq-dev, libmetis-dev, libopenblas-openmp-dev, pkg-config")
if(NLOPT_LIBRARY)
  string(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", libnlopt-dev")
endif()
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "flexframe")
set(CPACK_COMPONENT_DEV_DESCRIPTION "Libraries, headers and CMake package of Flexframe: simulation of flexible
multibody systems, kernel interpolation from few nodes to dense meshes,
drawing without a display.")

if(FLEXFRAME_PYTHON)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-flexframe)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= 3.11), python3 (<< 3.12), python3-numpy, ${opened}")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "ffmpeg")
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Scenes, simulation, kernel maps and pictures of Flexframe from Python, with
arrays that look at its memory.")
endif()

# Programs have HDF5 within them: its terms come with them.
if(HDF5_ARCHIVE AND NOT BUILD_SHARED_LIBS)
  flexframe_packages_of(hdf5 ${HDF5_ARCHIVE})
  if(EXISTS /usr/share/doc/${hdf5}/copyright)
    install(FILES /usr/share/doc/${hdf5}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/flexframe RENAME copyright.hdf5
      COMPONENT program)
  endif()
endif()

# What Debian wants of every package: copyright and changelog.
configure_file(${PROJECT_SOURCE_DIR}/render/package/debian/changelog ${PROJECT_BINARY_DIR}/package/changelog @ONLY)
find_program(GZIP gzip)
if(GZIP)
  execute_process(COMMAND ${GZIP} -9nc ${PROJECT_BINARY_DIR}/package/changelog OUTPUT_FILE ${PROJECT_BINARY_DIR}/package/changelog.gz)
  foreach(pair "program|flexframe" "dev|libflexframe-dev" "python|python3-flexframe")
    string(REPLACE "|" ";" pair ${pair})
    list(GET pair 0 component)
    list(GET pair 1 package)
    if(component STREQUAL "python" AND NOT FLEXFRAME_PYTHON)
      continue()
    endif()
    install(FILES ${PROJECT_SOURCE_DIR}/render/package/debian/copyright ${PROJECT_BINARY_DIR}/package/changelog.gz
      DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
  endforeach()
  install(FILES ${PROJECT_SOURCE_DIR}/render/package/debian/flexframe.lintian-overrides
    DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides RENAME flexframe COMPONENT program)
endif()

set(CPACK_SOURCE_GENERATOR TGZ)
set(CPACK_SOURCE_PACKAGE_FILE_NAME flexframe-${PROJECT_VERSION})
set(CPACK_SOURCE_IGNORE_FILES "/build/;/out/;/\\\\.git/;\\\\.git$;__pycache__;\\\\.tmp$")
include(CPack)
