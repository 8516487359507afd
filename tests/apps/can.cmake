# SHIFTRIG_FAULT_RUNS=1000 build/release/tests/bus_faults_test repeats what the suite does with 40 seeds.
add_executable(bus_faults_test ${CMAKE_CURRENT_LIST_DIR}/bus_faults_test.cpp)
target_link_libraries(bus_faults_test PRIVATE shiftrig_rig GTest::gtest_main)
target_compile_definitions(bus_faults_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
gtest_discover_tests(bus_faults_test DISCOVERY_MODE PRE_TEST)

if(NOT CMAKE_CXX_FLAGS MATCHES "fsanitize")  # counts calls of malloc
  add_executable(frame_fuzz_test ${CMAKE_CURRENT_LIST_DIR}/frame_fuzz_test.cpp ${CMAKE_SOURCE_DIR}/tests/io/count_allocations.cpp)
  target_link_libraries(frame_fuzz_test PRIVATE shiftrig_rig GTest::gtest_main)
  target_compile_definitions(frame_fuzz_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  gtest_discover_tests(frame_fuzz_test DISCOVERY_MODE PRE_TEST)
endif()

add_test(NAME candump_test COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/candump_test.py $<TARGET_FILE:shiftrig> ${CMAKE_SOURCE_DIR})
