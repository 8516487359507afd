include_guard()
include(${CMAKE_CURRENT_LIST_DIR}/tcu.cmake)
# The rig: plant, scenario, buses and loop put together.
add_library(shiftrig_rig STATIC
  ${CMAKE_CURRENT_LIST_DIR}/rig/buses.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/certificate.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/choices.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/collector.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/events.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/fork.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/rehearsal.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/rig.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/safe_command.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/scenario_run.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/session.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/timeline.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rig/variation.cpp)
target_link_libraries(shiftrig_rig PUBLIC shiftrig_tcu shiftrig_recording shiftrig_rt shiftrig_analysis)
# Where the shipped calibration lies, unless the command line says otherwise.
target_compile_definitions(shiftrig_rig PRIVATE SHIFTRIG_CONFIG="${CMAKE_SOURCE_DIR}/config")
