add_library(shiftrig_signals STATIC ${CMAKE_CURRENT_SOURCE_DIR}/signals.cpp ${CMAKE_CURRENT_SOURCE_DIR}/text_file.cpp)
target_link_libraries(shiftrig_signals PUBLIC shiftrig_plant)
