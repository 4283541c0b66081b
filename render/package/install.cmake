# cmake --install: program, libraries, public headers, licences, examples, FlexframeImageTest.cmake, find_package(flexframe).
# Components: program, dev.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/flexframe)
install(TARGETS flexframe_sim flexframe_interp flexframe_render flexframe_film EXPORT flexframe
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT program NAMELINK_COMPONENT dev)
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
  FILES_MATCHING PATTERN "*.toml" PATTERN "*.csv" PATTERN "*.md" PATTERN "studies" EXCLUDE PATTERN "accuracy-interp" EXCLUDE)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/assets DESTINATION ${CMAKE_INSTALL_DATADIR}/flexframe COMPONENT program
  FILES_MATCHING PATTERN "*.obj" PATTERN "*.mtl" PATTERN "*.sid" PATTERN "*.csv" PATTERN "*.toml" PATTERN "*.md")
