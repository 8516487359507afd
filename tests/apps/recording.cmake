# Snapshots, forks and golden recordings of the whole rig.
foreach(name snapshot_test golden_test)
  add_executable(${name} ${CMAKE_CURRENT_LIST_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE shiftrig_rig shiftrig_analysis GTest::gtest_main)
  target_compile_definitions(${name} PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST)
endforeach()
