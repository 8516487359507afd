# The example controllers as a user starts them, on python-can's bus.
add_test(NAME examples_test COMMAND ${CMAKE_SOURCE_DIR}/tests/io/with_multicast.sh /usr/bin/python3
  ${CMAKE_CURRENT_LIST_DIR}/examples_test.py $<TARGET_FILE:shiftrig> $<TARGET_FILE:cpp_controller> ${CMAKE_SOURCE_DIR})

# The rig on a real vcan (scripts/vcan-kernel), with can-utils and the kernel's own J1939.
add_test(NAME vcan_rig_test COMMAND /usr/bin/python3
  ${CMAKE_CURRENT_LIST_DIR}/vcan_rig_test.py $<TARGET_FILE:shiftrig> $<TARGET_FILE:shiftrig-tcu> ${CMAKE_SOURCE_DIR})
set_tests_properties(vcan_rig_test PROPERTIES LABELS vcan)
