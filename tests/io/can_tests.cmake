# Tests of io/can: one executable a subject.
function(shiftrig_can_test name)
  add_executable(${name} ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/${name}.cpp ${ARGN})
  target_link_libraries(${name} PRIVATE shiftrig_can GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST)
endfunction()

shiftrig_can_test(can_bus_test)
shiftrig_can_test(can_codec_test)
shiftrig_can_test(can_dbc_test)
shiftrig_can_test(can_link_test ${CMAKE_CURRENT_LIST_DIR}/count_allocations.cpp)
