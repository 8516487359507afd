# Tests of io/recording: one executable a subject.
foreach(name recording_log_test recording_kill_test recording_replay_test)
  add_executable(${name} ${CMAKE_CURRENT_LIST_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE shiftrig_recording ${SHIFTRIG_LCM_LIBRARY} GTest::gtest_main Threads::Threads)
  target_compile_definitions(${name} PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST)
endforeach()

add_executable(make_recording ${CMAKE_CURRENT_LIST_DIR}/make_recording.cpp)
target_link_libraries(make_recording PRIVATE shiftrig_recording Threads::Threads)
add_test(NAME mcap_export_opens_in_a_stock_reader
  COMMAND ${CMAKE_CURRENT_LIST_DIR}/mcap/run.sh $<TARGET_FILE:make_recording> $<TARGET_FILE:shiftrig> ${CMAKE_BINARY_DIR}/mcap_check)
