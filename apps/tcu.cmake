include_guard()
# A bus by its name; the reference controller: its core, its life on a bus, its program.
add_library(shiftrig_bus STATIC ${CMAKE_CURRENT_LIST_DIR}/bus/bus.cpp)
target_link_libraries(shiftrig_bus PUBLIC shiftrig_options shiftrig_can shiftrig_lcm)

add_library(shiftrig_tcu STATIC
  ${CMAKE_CURRENT_LIST_DIR}/tcu/calibration.cpp
  ${CMAKE_CURRENT_LIST_DIR}/tcu/controller.cpp
  ${CMAKE_CURRENT_LIST_DIR}/tcu/gear_choice.cpp
  ${CMAKE_CURRENT_LIST_DIR}/tcu/node.cpp
  ${CMAKE_CURRENT_LIST_DIR}/tcu/shift.cpp)
target_link_libraries(shiftrig_tcu PUBLIC shiftrig_options shiftrig_model shiftrig_bus)

find_package(CLI11 REQUIRED)
add_executable(shiftrig-tcu ${CMAKE_CURRENT_LIST_DIR}/tcu/main.cpp)
target_link_libraries(shiftrig-tcu PRIVATE shiftrig_tcu shiftrig_rt CLI11::CLI11)
# Where the shipped calibration lies, unless the command line says otherwise.
target_compile_definitions(shiftrig-tcu PRIVATE SHIFTRIG_CONFIG="${CMAKE_SOURCE_DIR}/config")
