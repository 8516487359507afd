add_executable(modal_test ${CMAKE_CURRENT_LIST_DIR}/modal_test.cpp)
target_link_libraries(modal_test PRIVATE shiftrig_plant GTest::gtest_main)
gtest_discover_tests(modal_test)
