add_executable(statics_test ${CMAKE_CURRENT_LIST_DIR}/statics_test.cpp)
target_link_libraries(statics_test PRIVATE shiftrig_plant GTest::gtest_main)
gtest_discover_tests(statics_test)
