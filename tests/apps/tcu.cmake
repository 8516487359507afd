add_executable(tcu_controller_test ${CMAKE_CURRENT_LIST_DIR}/tcu_controller_test.cpp)
target_link_libraries(tcu_controller_test PRIVATE shiftrig_tcu GTest::gtest_main)
target_compile_definitions(tcu_controller_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
gtest_discover_tests(tcu_controller_test)
