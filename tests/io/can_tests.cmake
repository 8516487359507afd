# Tests of io/can: one executable a subject.
function(shiftrig_can_test name)
  add_executable(${name} ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/${name}.cpp ${ARGN})
  target_link_libraries(${name} PRIVATE shiftrig_can GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST)
endfunction()

shiftrig_can_test(can_bus_test)
shiftrig_can_test(can_codec_test)
shiftrig_can_test(can_dbc_test)
shiftrig_can_test(can_link_test ${CMAKE_CURRENT_LIST_DIR}/count_allocations.cpp)
shiftrig_can_test(can_configuration_test)
shiftrig_can_test(can_candump_test)
shiftrig_can_test(can_faults_test ${CMAKE_CURRENT_LIST_DIR}/count_allocations.cpp)
shiftrig_can_test(can_j1939_test ${CMAKE_CURRENT_LIST_DIR}/count_allocations.cpp)

# In a network of its own (unshare), therefore one test of ctest.
add_executable(can_udp_test ${CMAKE_CURRENT_LIST_DIR}/can_udp_test.cpp)
target_link_libraries(can_udp_test PRIVATE shiftrig_can GTest::gtest_main)
add_test(NAME can_udp_test COMMAND ${CMAKE_CURRENT_LIST_DIR}/with_multicast.sh $<TARGET_FILE:can_udp_test>)

add_executable(can_socketcan_test ${CMAKE_CURRENT_LIST_DIR}/can_socketcan_test.cpp)
target_link_libraries(can_socketcan_test PRIVATE shiftrig_can GTest::gtest_main)
add_test(NAME can_socketcan_test COMMAND can_socketcan_test)
set_tests_properties(can_socketcan_test PROPERTIES LABELS vcan)

shiftrig_can_test(can_fuzz_test ${CMAKE_CURRENT_LIST_DIR}/count_allocations.cpp)
option(SHIFTRIG_FUZZ "build the libFuzzer targets (clang; scripts/fuzz)" OFF)
if(SHIFTRIG_FUZZ)
  # What reads foreign bytes, and no more of the project than that needs.
  file(GLOB FUZZED CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/io/can/*.cpp)
  add_library(fuzzed STATIC ${FUZZED} ${CMAKE_SOURCE_DIR}/io/signals.cpp ${CMAKE_SOURCE_DIR}/io/text_file.cpp ${CMAKE_SOURCE_DIR}/plant/signal.cpp)
  target_link_libraries(fuzzed PUBLIC shiftrig_options yaml-cpp Threads::Threads)
  foreach(target dbc candump datagram frames)
    add_executable(fuzz_${target} ${CMAKE_CURRENT_LIST_DIR}/can_fuzzer.cpp)
    target_link_libraries(fuzz_${target} PRIVATE fuzzed)
    target_compile_definitions(fuzz_${target} PRIVATE
      SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}" SHIFTRIG_FUZZ_TARGET=fuzz_${target})
    target_link_options(fuzz_${target} PRIVATE -fsanitize=fuzzer)
  endforeach()
endif()
