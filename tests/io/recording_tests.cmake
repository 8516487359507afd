# Tests of io/recording: one executable a subject.
foreach(name recording_log_test recording_kill_test)
  add_executable(${name} ${CMAKE_CURRENT_LIST_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE shiftrig_recording ${SHIFTRIG_LCM_LIBRARY} GTest::gtest_main Threads::Threads)
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST)
endforeach()
