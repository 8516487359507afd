# Recordings: an LCM event log written and read without the LCM library; only its types are needed.
find_package(nlohmann_json REQUIRED)
find_path(ZSTD_INCLUDE_DIR zstd.h REQUIRED DOC "zstd's headers (Debian: libzstd-dev)")
find_library(ZSTD_LIBRARY zstd REQUIRED DOC "the zstd library (Debian: libzstd-dev)")
file(GLOB RECORDING_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/recording/*.cpp)
add_library(shiftrig_recording STATIC ${RECORDING_SOURCES})
target_include_directories(shiftrig_recording SYSTEM PRIVATE ${ZSTD_INCLUDE_DIR})
target_link_libraries(shiftrig_recording
  PUBLIC shiftrig_signals shiftrig_lcmtypes shiftrig_model shiftrig_can
  PRIVATE nlohmann_json::nlohmann_json ${ZSTD_LIBRARY} Threads::Threads)
