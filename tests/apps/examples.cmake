# The example controllers as a user starts them, on python-can's bus.
add_test(NAME examples_test COMMAND ${CMAKE_SOURCE_DIR}/tests/io/with_multicast.sh /usr/bin/python3
  ${CMAKE_CURRENT_LIST_DIR}/examples_test.py $<TARGET_FILE:shiftrig> $<TARGET_FILE:cpp_controller> ${CMAKE_SOURCE_DIR})
