file(GLOB CAN_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/can/*.cpp)
add_library(shiftrig_can STATIC ${CAN_SOURCES})
find_package(yaml-cpp REQUIRED)
target_link_libraries(shiftrig_can PUBLIC shiftrig_signals shiftrig_options yaml-cpp Threads::Threads)
