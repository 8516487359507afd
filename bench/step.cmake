# ns per complete step by machine: step_bench; for chains see chain_bench.
if(NOT benchmark_FOUND)
  find_package(benchmark REQUIRED)
endif()
add_executable(step_bench ${CMAKE_CURRENT_LIST_DIR}/step.cpp)
target_compile_definitions(step_bench PRIVATE SHIFTRIG_CONFIG="${CMAKE_SOURCE_DIR}/config")
target_link_libraries(step_bench PRIVATE shiftrig_plant shiftrig_model benchmark::benchmark)
