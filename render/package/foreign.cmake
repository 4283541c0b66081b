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

# Sparse factorisation of finite element models: MUMPS (sequential), METIS ordering, OpenBLAS kernels. OpenBLAS with OpenMP starts threads
# when a reduction asks for them; the variant with its own threads starts them in every process, where they spin idle: 0.1 CPU s of each
# run.
find_library(MUMPS_LIBRARY NAMES dmumps_seq REQUIRED)
find_library(METIS_LIBRARY NAMES metis REQUIRED)
find_library(OPENBLAS_LIBRARY NAMES openblas PATH_SUFFIXES openblas-openmp REQUIRED)
# NLopt, where it is there: flexframe sweep --minimise.
find_library(NLOPT_LIBRARY NAMES nlopt)
find_path(NLOPT_INCLUDE_FOLDER NAMES nlopt.h)

if(NOT TARGET flexframe::sparse)
  add_library(flexframe::sparse INTERFACE IMPORTED GLOBAL)
  target_link_libraries(flexframe::sparse INTERFACE ${MUMPS_LIBRARY} ${METIS_LIBRARY} ${OPENBLAS_LIBRARY})
  add_library(flexframe::hdf5 INTERFACE IMPORTED GLOBAL)
  target_link_libraries(flexframe::hdf5 INTERFACE ${HDF5_LIBRARIES})
  add_library(flexframe::nlopt INTERFACE IMPORTED GLOBAL)
  if(NLOPT_LIBRARY)
    target_link_libraries(flexframe::nlopt INTERFACE ${NLOPT_LIBRARY})
  endif()
endif()
