# What is declared first counts: where dynmesh is built.
include(FetchContent)
FetchContent_Declare(dynmesh BINARY_DIR ${WHERE})
