# Every foreign library, in one place; README lists them with their licences.
find_package(Threads REQUIRED)
find_package(PkgConfig REQUIRED)

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(SUNDIALS 6 REQUIRED)
find_package(fmt REQUIRED)
find_package(HDF5 REQUIRED COMPONENTS C)
pkg_check_modules(tomlplusplus REQUIRED IMPORTED_TARGET tomlplusplus)

find_package(glm REQUIRED)
find_package(assimp REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
pkg_check_modules(stb REQUIRED IMPORTED_TARGET stb)
pkg_check_modules(deflate REQUIRED IMPORTED_TARGET libdeflate)

# Sparse factorisation of finite element models: MUMPS (sequential), METIS ordering, OpenBLAS kernels. OpenBLAS with OpenMP starts threads when a
# reduction asks for them; the variant with its own threads starts them in every process, where they spin idle: 0.1 CPU s of each run.
find_library(MUMPS_LIBRARY NAMES dmumps_seq REQUIRED)
find_library(METIS_LIBRARY NAMES metis REQUIRED)
find_library(OPENBLAS_LIBRARY NAMES openblas PATH_SUFFIXES openblas-openmp REQUIRED)
find_path(OPENBLAS_INCLUDE_FOLDER NAMES cblas.h PATH_SUFFIXES openblas-openmp openblas REQUIRED)
add_library(flexframe_sparse INTERFACE)
target_include_directories(flexframe_sparse SYSTEM INTERFACE ${OPENBLAS_INCLUDE_FOLDER})
target_link_libraries(flexframe_sparse INTERFACE ${MUMPS_LIBRARY} ${METIS_LIBRARY} ${OPENBLAS_LIBRARY})
