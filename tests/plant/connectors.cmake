if(SHIFTRIG_PLANT_ONLY)
  return()  # they read machines from files
endif()
# One program per kind of connector, found by its name.
file(GLOB CONNECTOR_TESTS CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/connectors/*_test.cpp)
foreach(source ${CONNECTOR_TESTS})
  get_filename_component(name ${source} NAME_WE)
  add_executable(${name} ${source})
  target_compile_definitions(${name} PRIVATE SHIFTRIG_TEST_DATA="${CMAKE_SOURCE_DIR}/tests/data"
                             SHIFTRIG_CONFIG="${CMAKE_SOURCE_DIR}/config")
  target_link_libraries(${name} PRIVATE shiftrig_plant shiftrig_model GTest::gtest_main)
  gtest_discover_tests(${name})
endforeach()
