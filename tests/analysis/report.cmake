add_executable(report_test ${CMAKE_CURRENT_LIST_DIR}/report_test.cpp)
target_link_libraries(report_test PRIVATE shiftrig_report GTest::gtest_main)
gtest_discover_tests(report_test)
