# Controllers to start one's own from; python_controller.py beside it needs no building.
add_executable(cpp_controller ${CMAKE_CURRENT_LIST_DIR}/examples/cpp_controller.cpp)
target_link_libraries(cpp_controller PRIVATE shiftrig_can)
