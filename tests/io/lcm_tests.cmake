# Tests of io/lcm. They run in a network namespace of their own, so each program is one test of ctest.
foreach(name lcm_endpoint_test lcm_link_test)
  add_executable(${name} ${CMAKE_CURRENT_LIST_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE shiftrig_lcm ${SHIFTRIG_LCM_LIBRARY} GTest::gtest_main Threads::Threads)
  add_test(NAME ${name} COMMAND ${CMAKE_CURRENT_LIST_DIR}/with_multicast.sh $<TARGET_FILE:${name}>)
endforeach()
