# Shifts, metrics, scorecard, comparison, plots.
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
file(GLOB SCORECARD_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/*.cpp)
list(FILTER SCORECARD_SOURCES EXCLUDE REGEX "driveline_")  # drawing.cmake
set(LIMITS ${CMAKE_SOURCE_DIR}/config/limits.yaml)
add_custom_command(
  OUTPUT ${CMAKE_BINARY_DIR}/limits_text.cpp
  COMMAND ${CMAKE_COMMAND} -DINPUT=${LIMITS} -DOUTPUT=${CMAKE_BINARY_DIR}/limits_text.cpp
          -DNAME=shiftrig::analysis::limits_text -DHEADER=analysis/limits_text.h -P ${CMAKE_SOURCE_DIR}/scripts/embed.cmake
  DEPENDS ${LIMITS} ${CMAKE_SOURCE_DIR}/scripts/embed.cmake)
add_library(shiftrig_analysis STATIC ${SCORECARD_SOURCES} ${CMAKE_BINARY_DIR}/limits_text.cpp)
target_link_libraries(shiftrig_analysis
  PUBLIC shiftrig_plant shiftrig_recording shiftrig_model nlohmann_json::nlohmann_json
  PRIVATE Eigen3::Eigen yaml-cpp)
