find_package(CLI11 REQUIRED)
add_executable(shiftrig_soak ${CMAKE_CURRENT_LIST_DIR}/soak.cpp)
target_link_libraries(shiftrig_soak PRIVATE shiftrig_rig CLI11::CLI11)
