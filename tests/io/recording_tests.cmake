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
  COMMAND ${CMAKE_CURRENT_LIST_DIR}/mcap/run.sh $<TARGET_FILE:make_recording> $<TARGET_FILE:shiftrig> ${CMAKE_BINARY_DIR}/mcap_check
          ${CMAKE_SOURCE_DIR})

add_executable(recording_fuzz_test ${CMAKE_CURRENT_LIST_DIR}/recording_fuzz.cpp)
target_link_libraries(recording_fuzz_test PRIVATE shiftrig_recording GTest::gtest_main Threads::Threads)
gtest_discover_tests(recording_fuzz_test DISCOVERY_MODE PRE_TEST)
option(SHIFTRIG_FUZZ "build the libFuzzer targets (clang; scripts/fuzz)" OFF)
if(SHIFTRIG_FUZZ)
  add_executable(fuzz_recording ${CMAKE_CURRENT_LIST_DIR}/recording_fuzz.cpp)
  target_compile_definitions(fuzz_recording PRIVATE SHIFTRIG_LIBFUZZER)
  target_link_libraries(fuzz_recording PRIVATE shiftrig_recording Threads::Threads)
  target_link_options(fuzz_recording PRIVATE -fsanitize=fuzzer)
endif()
