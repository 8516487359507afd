foreach(subject model_file scenario_file schema)
  add_executable(${subject}_test ${CMAKE_CURRENT_LIST_DIR}/${subject}_test.cpp)
  target_compile_definitions(${subject}_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  target_link_libraries(${subject}_test PRIVATE shiftrig_model GTest::gtest_main)
  gtest_discover_tests(${subject}_test)
endforeach()

# The schemas under an independent validator.
find_program(PYTHON3 /usr/bin/python3 REQUIRED)
add_test(NAME Schema.AcceptsWhatIsShippedAndRefusesWhatTheReaderRefuses
  COMMAND ${PYTHON3} ${CMAKE_CURRENT_LIST_DIR}/schema_test.py ${CMAKE_SOURCE_DIR})
