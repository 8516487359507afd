find_package(Python3 REQUIRED COMPONENTS Interpreter)
add_test(NAME scenarios_hold_and_a_bad_calibration_fails
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_CURRENT_LIST_DIR}/test_command_test.py $<TARGET_FILE:shiftrig> ${CMAKE_SOURCE_DIR})
set_tests_properties(scenarios_hold_and_a_bad_calibration_fails PROPERTIES TIMEOUT 300)
