# What needs nothing but the plant, so it is built for aarch64 too.
foreach(subject structure statics statics_article modal validation warnings explain closed_loop standstill wedged instant)
  add_executable(${subject}_test ${CMAKE_CURRENT_LIST_DIR}/${subject}_test.cpp)
  target_compile_definitions(${subject}_test PRIVATE SHIFTRIG_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data")
  target_link_libraries(${subject}_test PRIVATE shiftrig_plant GTest::gtest_main)
  gtest_discover_tests(${subject}_test)
endforeach()
