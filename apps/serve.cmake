# The live dashboard: HTTP beside the rig.
set(DASHBOARD ${CMAKE_SOURCE_DIR}/web/dist/dashboard.html)
add_custom_command(
  OUTPUT ${CMAKE_BINARY_DIR}/dashboard_page.cpp
  COMMAND ${CMAKE_COMMAND} -DINPUT=${DASHBOARD} -DOUTPUT=${CMAKE_BINARY_DIR}/dashboard_page.cpp
          -DNAME=shiftrig::serve::dashboard_page -DHEADER=apps/serve/page.h -P ${CMAKE_SOURCE_DIR}/scripts/embed.cmake
  DEPENDS ${DASHBOARD} ${CMAKE_SOURCE_DIR}/scripts/embed.cmake)
find_library(HTTPLIB cpp-httplib REQUIRED)  # Debian compiles it
add_library(shiftrig_http STATIC ${CMAKE_CURRENT_SOURCE_DIR}/serve/http.cpp ${CMAKE_BINARY_DIR}/dashboard_page.cpp)
target_link_libraries(shiftrig_http PUBLIC shiftrig_options Threads::Threads PRIVATE ${HTTPLIB})

include(${CMAKE_CURRENT_LIST_DIR}/rig.cmake)
add_library(shiftrig_serve STATIC
  ${CMAKE_CURRENT_LIST_DIR}/serve/dashboard.cpp
  ${CMAKE_CURRENT_LIST_DIR}/serve/machine_page.cpp)
target_link_libraries(shiftrig_serve PUBLIC shiftrig_http shiftrig_rig shiftrig_report shiftrig_drawing)
