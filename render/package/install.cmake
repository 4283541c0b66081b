# cmake --install: program, libraries, public headers, licences, examples, FlexframeImageTest.cmake, find_package(flexframe).
# Components: program, dev, python.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/flexframe)
install(TARGETS flexframe_sim flexframe_interp flexframe_render flexframe_film EXPORT flexframe
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT program NAMELINK_COMPONENT dev)
# Installed anywhere, shared libraries are found beside each other and from the program.
if(BUILD_SHARED_LIBS)
  file(RELATIVE_PATH to_libraries ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
  set_target_properties(flexframe PROPERTIES INSTALL_RPATH "$ORIGIN/${to_libraries}")
  set_target_properties(flexframe_sim flexframe_interp flexframe_render flexframe_film PROPERTIES INSTALL_RPATH "$ORIGIN")
endif()
# The program is none of the exported targets: it comes in a package of its own, and the configuration file looks for it.
install(TARGETS flexframe RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(DIRECTORY ${FLEXFRAME_PUBLIC_FOLDER}/flexframe DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev)

install(EXPORT flexframe NAMESPACE flexframe:: FILE flexframe-targets.cmake DESTINATION ${package_folder} COMPONENT dev)
configure_package_config_file(${PROJECT_SOURCE_DIR}/render/package/flexframe-config.cmake.in
  ${PROJECT_BINARY_DIR}/package/flexframe-config.cmake INSTALL_DESTINATION ${package_folder} PATH_VARS CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/package/flexframe-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/package/flexframe-config.cmake ${PROJECT_BINARY_DIR}/package/flexframe-config-version.cmake
  ${PROJECT_SOURCE_DIR}/render/package/foreign.cmake
  ${PROJECT_SOURCE_DIR}/tests/image/FlexframeImageTest.cmake ${PROJECT_SOURCE_DIR}/tests/image/run_image_test.cmake
  DESTINATION ${package_folder} COMPONENT dev)

install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(FILES sim/SCENE.md sim/RESULTS.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
# Scenes name meshes and bodies as ../assets/...: both folders side by side.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/flexframe COMPONENT program
  FILES_MATCHING PATTERN "*.toml" PATTERN "*.csv" PATTERN "*.md" PATTERN "*.ipynb"
  PATTERN "studies" EXCLUDE PATTERN "accuracy-interp" EXCLUDE PATTERN "pages" EXCLUDE)
# Programs outside of the tree, and recipes of image tests, to copy.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/library DESTINATION ${CMAKE_INSTALL_DATADIR}/flexframe/examples COMPONENT dev
  FILES_MATCHING PATTERN "*.cpp" PATTERN "CMakeLists.txt")
install(FILES ${PROJECT_SOURCE_DIR}/tests/image/workflow.yml ${PROJECT_SOURCE_DIR}/tests/image/gitlab.yml
  DESTINATION ${CMAKE_INSTALL_DATADIR}/flexframe COMPONENT dev)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/assets DESTINATION ${CMAKE_INSTALL_DATADIR}/flexframe COMPONENT program
  FILES_MATCHING PATTERN "*.obj" PATTERN "*.mtl" PATTERN "*.sid" PATTERN "*.csv" PATTERN "*.toml" PATTERN "*.md")

if(FLEXFRAME_PYTHON)
  # Where Debian keeps modules of all versions of Python 3, and this one's own.
  set(FLEXFRAME_PYTHON_FOLDER lib/python3/dist-packages CACHE STRING "folder of Python modules below the prefix")
  if(BUILD_SHARED_LIBS)
    file(RELATIVE_PATH to_libraries ${CMAKE_INSTALL_PREFIX}/${FLEXFRAME_PYTHON_FOLDER}/flexframe ${CMAKE_INSTALL_FULL_LIBDIR})
    set_target_properties(flexframe_python PROPERTIES INSTALL_RPATH "$ORIGIN/${to_libraries}")
  endif()
  install(TARGETS flexframe_python LIBRARY DESTINATION ${FLEXFRAME_PYTHON_FOLDER}/flexframe COMPONENT python)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/render/python/flexframe/ DESTINATION ${FLEXFRAME_PYTHON_FOLDER}/flexframe COMPONENT python
    FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed")
endif()

# Manual pages and completions, from what the program says of itself.
find_program(SYSTEM_PYTHON python3 PATHS /usr/bin NO_DEFAULT_PATH)
find_program(GZIP gzip)
if(SYSTEM_PYTHON AND GZIP AND NOT CMAKE_CROSSCOMPILING)
  set(manual ${PROJECT_BINARY_DIR}/package/manual)
  install(CODE "
    execute_process(COMMAND ${SYSTEM_PYTHON} ${PROJECT_SOURCE_DIR}/render/package/manual.py $<TARGET_FILE:flexframe> ${manual}
      COMMAND_ERROR_IS_FATAL ANY)
    file(GLOB pages ${manual}/man1/*.1)
    execute_process(COMMAND ${GZIP} -9nf \${pages} COMMAND_ERROR_IS_FATAL ANY)" COMPONENT program)
  install(DIRECTORY ${manual}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT program FILES_MATCHING PATTERN "*.gz")
  install(FILES ${manual}/flexframe.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME flexframe COMPONENT
    program)
  install(FILES ${manual}/_flexframe DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program)
  install(FILES ${manual}/flexframe.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
endif()

include(${PROJECT_SOURCE_DIR}/render/package/packages.cmake)
