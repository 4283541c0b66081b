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

# Sparse factorisation of finite element models: MUMPS (sequential), METIS ordering, OpenBLAS kernels.
find_library(MUMPS_LIBRARY NAMES dmumps_seq REQUIRED)
find_library(METIS_LIBRARY NAMES metis REQUIRED)
pkg_check_modules(openblas REQUIRED IMPORTED_TARGET openblas)
add_library(flexframe_sparse INTERFACE)
target_link_libraries(flexframe_sparse INTERFACE ${MUMPS_LIBRARY} ${METIS_LIBRARY} PkgConfig::openblas)
