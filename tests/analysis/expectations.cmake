add_executable(expectations_test ${CMAKE_CURRENT_LIST_DIR}/expectations_test.cpp
               ${CMAKE_CURRENT_LIST_DIR}/junit_test.cpp)
target_link_libraries(expectations_test PRIVATE shiftrig_analysis GTest::gtest_main)
gtest_discover_tests(expectations_test)
