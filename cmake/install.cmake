# Installs the library, headers, files for CMake and pkg-config, licences, and dynmesh-complete. The
# files for CMake name the parts of the library as well.
install(TARGETS dynmesh dynmesh-io EXPORT dynmesh-targets)
if(TARGET dynmesh-completion)
  install(TARGETS dynmesh-completion EXPORT dynmesh-targets)
endif()
install(DIRECTORY cpp/include/dynmesh ${CMAKE_CURRENT_BINARY_DIR}/include/dynmesh
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.h" PATTERN "*.hpp")
install(EXPORT dynmesh-targets NAMESPACE dynmesh::
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/dynmesh)
configure_package_config_file(cmake/dynmesh-config.cmake.in dynmesh-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/dynmesh)
write_basic_package_version_file(dynmesh-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/dynmesh-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/dynmesh-config-version.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/dynmesh)

set(licences LICENSE third_party_notes/licences/Eigen.txt third_party_notes/licences/nanoflann.txt)
if(DYNMESH_HAS_SOURCES_OF_OPENMESH)
  list(APPEND licences third_party_notes/licences/OpenMesh.txt)
endif()
install(FILES ${licences} DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/dynmesh)

# The file for pkg-config, which stays valid if the prefix is moved. `runtime` lists the libraries
# that a C compiler does not link by default.
set(runtime ${CMAKE_CXX_IMPLICIT_LINK_LIBRARIES})
list(FILTER runtime INCLUDE REGEX "^((std)?c[+][+]|m)$")
if(WIN32)
  list(APPEND runtime synchronization)
endif()
list(TRANSFORM runtime PREPEND "-l")
list(JOIN runtime " " runtime)
set(openmesh "-L$<TARGET_LINKER_FILE_DIR:OpenMeshCore> -lOpenMeshCore ")
if(DYNMESH_HAS_SOURCES_OF_OPENMESH)
  set(openmesh "")
endif()
set(static_define "")
if(NOT BUILD_SHARED_LIBS)
  set(static_define " -DDYNMESH_STATIC_DEFINE")
endif()
set(pc_folder ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH headers ${pc_folder} ${CMAKE_INSTALL_FULL_INCLUDEDIR})
configure_file(cmake/dynmesh.pc.in dynmesh.pc.in @ONLY)
file(GENERATE OUTPUT dynmesh.pc INPUT ${CMAKE_CURRENT_BINARY_DIR}/dynmesh.pc.in)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/dynmesh.pc
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

if(DYNMESH_APPS)
  if(BUILD_SHARED_LIBS)
    # Let the program find its library even if the prefix is moved, and not where it was built.
    file(RELATIVE_PATH to_library ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
    set_target_properties(dynmesh-complete PROPERTIES INSTALL_RPATH "$ORIGIN/${to_library}"
                                                      INSTALL_RPATH_USE_LINK_PATH OFF)
  endif()
  install(TARGETS dynmesh-complete)
endif()
