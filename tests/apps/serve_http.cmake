add_executable(serve_http_test ${CMAKE_CURRENT_LIST_DIR}/serve_http_test.cpp)
target_link_libraries(serve_http_test PRIVATE shiftrig_http GTest::gtest_main)
gtest_discover_tests(serve_http_test)
