add_library(shiftrig_drawing STATIC
  ${CMAKE_CURRENT_SOURCE_DIR}/driveline_dot.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/driveline_graph.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/driveline_svg.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/driveline_symbols.cpp)
target_link_libraries(shiftrig_drawing PUBLIC shiftrig_plant)
