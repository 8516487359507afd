include_guard()
# The reference controller: its core, its life on a bus, its program.
add_library(shiftrig_tcu STATIC
  ${CMAKE_CURRENT_LIST_DIR}/tcu/calibration.cpp
  ${CMAKE_CURRENT_LIST_DIR}/tcu/controller.cpp
  ${CMAKE_CURRENT_LIST_DIR}/tcu/gear_choice.cpp
  ${CMAKE_CURRENT_LIST_DIR}/tcu/shift.cpp)
target_link_libraries(shiftrig_tcu PUBLIC shiftrig_options shiftrig_model)
