find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
add_library(shiftrig_model STATIC
  ${CMAKE_CURRENT_SOURCE_DIR}/build_model.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/model_file.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/rule.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/scenario_file.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/units.cpp
  ${CMAKE_CURRENT_SOURCE_DIR}/yaml_document.cpp)
target_link_libraries(shiftrig_model PUBLIC shiftrig_plant shiftrig_signals yaml-cpp nlohmann_json::nlohmann_json)
