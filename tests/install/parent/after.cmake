# What tests/install/parent/configure adds to the project of docs/embedding.md that contains dynmesh: a
# program, and a static library that other projects can find.
set(tests ${dynmesh_SOURCE_DIR}/tests/install)
add_executable(uses-dynmesh ${tests}/main.cpp)
target_link_libraries(uses-dynmesh PRIVATE dynmesh::dynmesh)
target_compile_options(uses-dynmesh PRIVATE -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror)

add_library(parts STATIC ${tests}/host/plugin.cpp)
target_link_libraries(parts PRIVATE dynmesh::completion dynmesh::scans dynmesh::io)
# The part that completes alone would take as long to compile as all of dynmesh.
set_target_properties(parts PROPERTIES OPTIMIZE_DEPENDENCIES ON)
add_dependencies(parts dynmesh-io)
target_compile_options(parts PRIVATE -fexceptions)
install(TARGETS parts EXPORT parts)
install(EXPORT parts DESTINATION lib/cmake/parts NAMESPACE parts:: FILE parts-config.cmake)
export(EXPORT parts)
