# The foreign libraries that Flexframe's libraries link: included by the build and, where Flexframe's are static, by
# find_package(flexframe).
set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(SUNDIALS 6 REQUIRED)
find_package(fmt REQUIRED)
pkg_check_modules(tomlplusplus REQUIRED IMPORTED_TARGET GLOBAL tomlplusplus)

# CMake looks for HDF5 with a compiler for C.
get_property(flexframe_languages GLOBAL PROPERTY ENABLED_LANGUAGES)
if(NOT "C" IN_LIST flexframe_languages)
  enable_language(C)
endif()
find_package(HDF5 REQUIRED COMPONENTS C)

find_package(glm REQUIRED)
find_package(assimp REQUIRED)
find_package(meshoptimizer REQUIRED)
pkg_check_modules(deflate REQUIRED IMPORTED_TARGET GLOBAL libdeflate)

# NLopt, where it is there: flexframe sweep --minimise.
find_library(NLOPT_LIBRARY NAMES nlopt)
find_path(NLOPT_INCLUDE_FOLDER NAMES nlopt.h)

if(NOT TARGET flexframe::hdf5)
  add_library(flexframe::hdf5 INTERFACE IMPORTED GLOBAL)
  target_link_libraries(flexframe::hdf5 INTERFACE ${HDF5_LIBRARIES})
  add_library(flexframe::nlopt INTERFACE IMPORTED GLOBAL)
  if(NLOPT_LIBRARY)
    target_link_libraries(flexframe::nlopt INTERFACE ${NLOPT_LIBRARY})
  endif()
endif()
