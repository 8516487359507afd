add_executable(ark3_test ${CMAKE_CURRENT_LIST_DIR}/ark3_test.cpp ${CMAKE_CURRENT_LIST_DIR}/random_forests.cpp)
target_link_libraries(ark3_test PRIVATE shiftrig_plant GTest::gtest_main)
target_compile_definitions(ark3_test PRIVATE SHIFTRIG_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
gtest_discover_tests(ark3_test)

add_executable(tree_kernels_test ${CMAKE_CURRENT_LIST_DIR}/tree_kernels_test.cpp)
target_link_libraries(tree_kernels_test PRIVATE shiftrig_plant GTest::gtest_main)
gtest_discover_tests(tree_kernels_test)

add_executable(remembering_test ${CMAKE_CURRENT_LIST_DIR}/remembering_test.cpp)
target_compile_definitions(remembering_test PRIVATE SHIFTRIG_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
target_link_libraries(remembering_test PRIVATE shiftrig_comparison shiftrig_plant GTest::gtest_main)
gtest_discover_tests(remembering_test)
