# Libraries that are opened where the first of their functions is called (sim/base/late_library): nothing is linked with them. Of these
# the file that a linker would have named is known to the sources, and their packages to those of Flexframe.

# Sparse factorisation of finite element models: MUMPS (sequential), METIS ordering, OpenBLAS kernels. OpenBLAS with OpenMP starts threads
# when a reduction asks for them; the variant with its own threads would start them with the library, where they spin idle.
find_library(MUMPS_LIBRARY NAMES dmumps_seq REQUIRED)
find_library(METIS_LIBRARY NAMES metis REQUIRED)
find_library(OPENBLAS_LIBRARY NAMES openblas PATH_SUFFIXES openblas-openmp REQUIRED)
# Files of other programs.
find_library(NETCDF_LIBRARY NAMES netcdf REQUIRED)
find_library(MATIO_LIBRARY NAMES matio REQUIRED)
find_library(LIBZIP_LIBRARY NAMES zip REQUIRED)

# flexframe_late(NAME SOURCE): FLEXFRAME_NAME_FILE for this source, of the library NAME_LIBRARY.
function(flexframe_late name source)
  execute_process(COMMAND ${CMAKE_OBJDUMP} -p ${${name}_LIBRARY} OUTPUT_VARIABLE head ERROR_QUIET)
  if(NOT head MATCHES "SONAME +([^ \n]+)")
    message(FATAL_ERROR "${${name}_LIBRARY} is no shared library with a name of its own (SONAME)")
  endif()
  set_property(SOURCE ${source} APPEND PROPERTY COMPILE_DEFINITIONS FLEXFRAME_${name}_FILE="${CMAKE_MATCH_1}")
endfunction()

# The Debian packages of libraries, in `out`; none where these do not come from packages.
function(flexframe_packages_of out)
  set(packages "")
  foreach(library ${ARGN})
    file(REAL_PATH ${library} file)
    execute_process(COMMAND dpkg-query --search ${file} OUTPUT_VARIABLE found ERROR_QUIET)
    if(found MATCHES "^([^: ]+)")
      list(APPEND packages ${CMAKE_MATCH_1})
    endif()
  endforeach()
  set(${out} ${packages} PARENT_SCOPE)
endfunction()
