add_executable(serve_http_test ${CMAKE_CURRENT_LIST_DIR}/serve_http_test.cpp)
target_link_libraries(serve_http_test PRIVATE shiftrig_http GTest::gtest_main)
gtest_discover_tests(serve_http_test)

# The same, and worse, against the dashboard of a running rig.
add_test(NAME serve_attack_test COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/serve_attack_test.py $<TARGET_FILE:shiftrig>
  ${CMAKE_SOURCE_DIR})

# What its user asks of a dashboard while it records, and how it ends.
add_test(NAME serve_command_test COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/serve_command_test.py $<TARGET_FILE:shiftrig>
  ${CMAKE_SOURCE_DIR}/config)
