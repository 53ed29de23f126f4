# OpenMesh, Eigen and nanoflann: those of the system, or else their sources, which are downloaded.
# Sets DYNMESH_CONNECTIVITY, the target of OpenMesh, and DYNMESH_HAS_SOURCES_OF_OPENMESH.
include(FetchContent)

# Sets FOLDER to where the sources are. Their own projects are not added: of OpenMesh a few files are
# compiled, and the others are headers.
function(dynmesh_download name url hash folder)
  string(TOLOWER ${name} content)
  string(TOUPPER FETCHCONTENT_SOURCE_DIR_${name} given)
  get_filename_component(archive ${url} NAME)
  set(archive ${CMAKE_CURRENT_BINARY_DIR}/downloads/${archive})
  if(NOT ${given} AND NOT EXISTS ${archive})
    message(STATUS "${name} was not found; its sources are downloaded: ${url}")
    file(DOWNLOAD ${url} ${archive} STATUS status)
    list(POP_FRONT status failed)
    if(failed)
      file(REMOVE ${archive})
      message(FATAL_ERROR
        "${name} is not installed, and downloading ${url} failed: ${status}. Install it (Debian: "
        "libopenmesh-dev, libeigen3-dev, libnanoflann-dev), or name a folder with its sources:\n"
        "  cmake -D${given}=FOLDER ...\n  pip install . -C cmake.define.${given}=FOLDER")
    endif()
  endif()
  FetchContent_Declare(${content} URL ${archive} URL_HASH SHA256=${hash}
                       DOWNLOAD_EXTRACT_TIMESTAMP ON SOURCE_SUBDIR is-not-added)
  FetchContent_MakeAvailable(${content})
  set(${folder} ${${content}_SOURCE_DIR} PARENT_SCOPE)
endfunction()

# Global, so that a project that contains dynmesh can link them. No version of OpenMesh is requested,
# since the package of Debian has no version file.
find_package(OpenMesh QUIET GLOBAL)
find_package(Eigen3 3.4 QUIET GLOBAL)
find_package(nanoflann 1.4 QUIET GLOBAL)

set(DYNMESH_HAS_SOURCES_OF_OPENMESH OFF)
set(DYNMESH_CONNECTIVITY OpenMeshCore)
if(NOT TARGET OpenMeshCore)
  dynmesh_download(OpenMesh
    https://www.graphics.rwth-aachen.de/media/openmesh_static/Releases/11.0/OpenMesh-11.0.0.tar.bz2
    9d22e65bdd6a125ac2043350a019ec4346ea83922cafdf47e125a03c16f6fa07 folder)
  file(GLOB sources ${folder}/src/OpenMesh/Core/Mesh/*.cc ${folder}/src/OpenMesh/Core/System/*.cc
       ${folder}/src/OpenMesh/Core/Utils/*.cc)
  # Part of the library of dynmesh, so that nothing else is installed, under another name, since a
  # program may contain an OpenMesh of its own.
  add_library(dynmesh-openmesh OBJECT ${sources})
  target_include_directories(dynmesh-openmesh SYSTEM PUBLIC ${folder}/src)
  target_compile_definitions(dynmesh-openmesh PUBLIC OpenMesh=dynmesh_openmesh
    $<$<BOOL:${WIN32}>:NOMINMAX;_USE_MATH_DEFINES>)
  target_compile_options(dynmesh-openmesh PRIVATE -w)
  set_target_properties(dynmesh-openmesh PROPERTIES POSITION_INDEPENDENT_CODE ON UNITY_BUILD OFF)
  set(DYNMESH_HAS_SOURCES_OF_OPENMESH ON)
  set(DYNMESH_CONNECTIVITY dynmesh-openmesh)
  dynmesh_compile(dynmesh-openmesh)
endif()
if(NOT TARGET Eigen3::Eigen)
  dynmesh_download(Eigen https://gitlab.com/libeigen/eigen/-/archive/3.4.0/eigen-3.4.0.tar.gz
    8586084f71f9bde545ee7fa6d00288b264a2b7ac3607b974e54d13e7162c1c72 folder)
  add_library(Eigen3::Eigen INTERFACE IMPORTED GLOBAL)
  target_include_directories(Eigen3::Eigen INTERFACE ${folder})
endif()
if(NOT TARGET nanoflann::nanoflann)
  dynmesh_download(nanoflann https://github.com/jlblancoc/nanoflann/archive/refs/tags/v1.4.2.tar.gz
    97fce650eb644a359a767af526cab9ba31842e53790a7279887e1ae2fffe7319 folder)
  add_library(nanoflann::nanoflann INTERFACE IMPORTED GLOBAL)
  target_include_directories(nanoflann::nanoflann INTERFACE ${folder}/include)
endif()
