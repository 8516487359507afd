# LCM as a bus: messages of lcmtypes/ against signals.
file(GLOB LCM_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/lcm/*.cpp)
add_library(shiftrig_lcm STATIC ${LCM_SOURCES})
target_link_libraries(shiftrig_lcm PUBLIC shiftrig_signals shiftrig_lcmtypes
  PRIVATE ${SHIFTRIG_LCM_LIBRARY} Threads::Threads)
