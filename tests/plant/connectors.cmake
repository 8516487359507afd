foreach(subject freewheel backlash)
  add_executable(${subject}_test ${CMAKE_CURRENT_LIST_DIR}/${subject}_test.cpp)
  target_compile_definitions(${subject}_test PRIVATE SHIFTRIG_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data"
                             SHIFTRIG_CONFIG="${CMAKE_SOURCE_DIR}/config")
  target_link_libraries(${subject}_test PRIVATE shiftrig_plant shiftrig_model GTest::gtest_main)
  gtest_discover_tests(${subject}_test)
endforeach()
