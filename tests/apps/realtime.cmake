# Counts calls of malloc, which the sanitizers want for themselves.
if(NOT CMAKE_CXX_FLAGS MATCHES "fsanitize")
  add_executable(realtime_test ${CMAKE_CURRENT_LIST_DIR}/realtime_test.cpp)
  target_compile_definitions(realtime_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  target_link_libraries(realtime_test PRIVATE shiftrig_rig GTest::gtest_main)
  gtest_discover_tests(realtime_test)
endif()
if(NOT CMAKE_CXX_FLAGS MATCHES "fsanitize" AND SHIFTRIG_BENCH)
  add_test(NAME Soak.OneMinuteUnderStallsAndThreePassesOfAllScenarios COMMAND ${CMAKE_SOURCE_DIR}/scripts/soak suite)
  set_tests_properties(Soak.OneMinuteUnderStallsAndThreePassesOfAllScenarios PROPERTIES
    ENVIRONMENT "SHIFTRIG_PROGRAMS=${CMAKE_BINARY_DIR}" PASS_REGULAR_EXPRESSION "soak passed" LABELS slow)
endif()
