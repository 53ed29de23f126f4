# Compiles a target that includes internal headers, whatever the flags of the project that contains
# dynmesh. Nothing is linked, so that nothing else need be exported with a static library.
function(dynmesh_compile target)
  target_compile_features(${target} PRIVATE cxx_std_20)
  target_include_directories(${target} PRIVATE
    ${PROJECT_SOURCE_DIR}/cpp/include ${PROJECT_BINARY_DIR}/include ${PROJECT_SOURCE_DIR}/cpp/src)
  target_include_directories(${target} SYSTEM PRIVATE
    $<TARGET_PROPERTY:Eigen3::Eigen,INTERFACE_INCLUDE_DIRECTORIES>
    $<TARGET_PROPERTY:nanoflann::nanoflann,INTERFACE_INCLUDE_DIRECTORIES>
    $<TARGET_PROPERTY:${DYNMESH_CONNECTIVITY},INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(${target} PRIVATE
    $<TARGET_PROPERTY:${DYNMESH_CONNECTIVITY},INTERFACE_COMPILE_DEFINITIONS>
    # Refuse the files of Eigen that are licensed under the LGPL. Keep its larger arrays off the
    # stack, of which threads have 128 kB on some systems.
    EIGEN_MPL2_ONLY EIGEN_STACK_ALLOCATION_LIMIT=16384
    # A program may contain both a static dynmesh and these libraries, of another version or
    # compiled for another alignment. Of functions with the same name, the linker takes one for all.
    Eigen=dynmesh_eigen nanoflann=dynmesh_nanoflann
    # The circulators of OpenMesh are ten times slower with assertions.
    $<$<OR:$<BOOL:${DYNMESH_OPTIMIZE}>,$<NOT:$<CONFIG:Debug>>>:NDEBUG>)
  # NaN marks missing vertices, errors are exceptions, and matrices of Eigen are stored by columns.
  if(MSVC)
    set(optimised /O2 /Ob2)
    target_compile_options(${target} PRIVATE /fp:precise)
  else()
    set(optimised -O3)
    target_compile_options(${target} PRIVATE
      -fno-fast-math -fno-finite-math-only -fno-associative-math
      $<$<CXX_COMPILER_ID:GNU>:-fno-unsafe-math-optimizations>  # Clang compiles slower code with it
      -fexceptions -frtti -UEIGEN_DEFAULT_TO_ROW_MAJOR -UEIGEN_DEFAULT_DENSE_INDEX_TYPE
      -UEIGEN_NO_AUTOMATIC_RESIZING -UEIGEN_NO_MALLOC -UEIGEN_USE_BLAS -UEIGEN_USE_LAPACKE
      -UEIGEN_USE_MKL_ALL)
  endif()
  if(DYNMESH_OPTIMIZE)
    target_compile_options(${target} PRIVATE
      "$<$<NOT:$<CONFIG:Release,RelWithDebInfo,MinSizeRel>>:${optimised}>")
  endif()
endfunction()
