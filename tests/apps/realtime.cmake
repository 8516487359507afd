# Counts calls of malloc, which the sanitizers want for themselves.
if(NOT CMAKE_CXX_FLAGS MATCHES "fsanitize")
  add_executable(realtime_test ${CMAKE_CURRENT_LIST_DIR}/realtime_test.cpp)
  target_compile_definitions(realtime_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  target_link_libraries(realtime_test PRIVATE shiftrig_rig GTest::gtest_main)
  gtest_discover_tests(realtime_test TEST_FILTER -*PlantThreadOnABus*)
  foreach(bus Udpcan Lcm)
    add_test(NAME PlantThreadOn${bus} COMMAND ${CMAKE_SOURCE_DIR}/tests/io/with_multicast.sh
      $<TARGET_FILE:realtime_test> --gtest_filter=${bus}/PlantThreadOnABus.*)
  endforeach()
  add_test(NAME PlantThreadOnVcan COMMAND realtime_test --gtest_filter=Vcan/PlantThreadOnABus.*)
  set_tests_properties(PlantThreadOnVcan PROPERTIES LABELS vcan)
endif()
if(NOT CMAKE_CXX_FLAGS MATCHES "fsanitize" AND SHIFTRIG_BENCH)
  add_test(NAME Soak.OneMinuteUnderStallsAndThreePassesOfAllScenarios COMMAND ${CMAKE_SOURCE_DIR}/scripts/soak suite)
  set_tests_properties(Soak.OneMinuteUnderStallsAndThreePassesOfAllScenarios PROPERTIES
    ENVIRONMENT "SHIFTRIG_PROGRAMS=${CMAKE_BINARY_DIR}" PASS_REGULAR_EXPRESSION "soak passed" LABELS slow)
endif()

add_test(NAME Soak.OneMinuteAtFullLoadOfTheBus COMMAND ${CMAKE_SOURCE_DIR}/scripts/soak bus --minutes 1)
set_tests_properties(Soak.OneMinuteAtFullLoadOfTheBus PROPERTIES
  ENVIRONMENT "SHIFTRIG_PROGRAMS=${CMAKE_BINARY_DIR}" PASS_REGULAR_EXPRESSION "soak passed" LABELS vcan)
