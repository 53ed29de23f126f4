# The C++ package: library, headers, package configuration and dynmesh-complete.
install(TARGETS dynmesh EXPORT dynmesh-targets)
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

if(DYNMESH_APPS)
  if(BUILD_SHARED_LIBS)
    # Found beside its library wherever the prefix is moved to.
    file(RELATIVE_PATH to_library ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
    set_target_properties(dynmesh-complete PROPERTIES INSTALL_RPATH "$ORIGIN/${to_library}")
  endif()
  install(TARGETS dynmesh-complete)
endif()
