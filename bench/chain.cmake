find_package(benchmark REQUIRED)
add_executable(chain_bench ${CMAKE_CURRENT_LIST_DIR}/chain_bench.cpp)
target_link_libraries(chain_bench PRIVATE shiftrig_plant benchmark::benchmark)
