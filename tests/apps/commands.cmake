find_package(nlohmann_json REQUIRED)
foreach(subject check_command statics_command)
  add_executable(${subject}_test ${CMAKE_CURRENT_LIST_DIR}/${subject}_test.cpp)
  target_compile_definitions(${subject}_test PRIVATE
    SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}" SHIFTRIG_PROGRAM="$<TARGET_FILE:shiftrig>")
  target_link_libraries(${subject}_test PRIVATE shiftrig_options nlohmann_json::nlohmann_json GTest::gtest_main)
  add_dependencies(${subject}_test shiftrig)
  gtest_discover_tests(${subject}_test)
endforeach()

add_executable(tractor_test ${CMAKE_CURRENT_LIST_DIR}/tractor_test.cpp)
target_compile_definitions(tractor_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
target_link_libraries(tractor_test PRIVATE shiftrig_model GTest::gtest_main)
gtest_discover_tests(tractor_test)

add_executable(article_test ${CMAKE_CURRENT_LIST_DIR}/article_test.cpp)
target_compile_definitions(article_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
target_link_libraries(article_test PRIVATE shiftrig_rig GTest::gtest_main)
gtest_discover_tests(article_test)

# What the commands do with the files they are given, and with those that are not whole.
add_test(NAME files_test COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/files_test.py $<TARGET_FILE:shiftrig> ${CMAKE_SOURCE_DIR}/config)

add_test(NAME json_docs_test COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/json_docs_test.py $<TARGET_FILE:shiftrig> ${CMAKE_SOURCE_DIR})

if(SHIFTRIG_BENCH)
  set(SOAK $<TARGET_FILE:shiftrig_soak>)
endif()
add_test(NAME numbers_test COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/numbers_test.py
  $<TARGET_FILE:shiftrig> ${CMAKE_SOURCE_DIR}/config ${SOAK})
