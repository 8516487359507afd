# The report: its page is made by web/ and built in.
set(REPORT_PAGE ${CMAKE_SOURCE_DIR}/web/dist/report.html)
add_custom_command(
  OUTPUT ${CMAKE_BINARY_DIR}/report_page.cpp
  COMMAND ${CMAKE_COMMAND} -DINPUT=${REPORT_PAGE} -DOUTPUT=${CMAKE_BINARY_DIR}/report_page.cpp
          -DNAME=shiftrig::analysis::report_page -DHEADER=analysis/report/report_page.h -P ${CMAKE_SOURCE_DIR}/scripts/embed.cmake
  DEPENDS ${REPORT_PAGE} ${CMAKE_SOURCE_DIR}/scripts/embed.cmake)
find_package(nlohmann_json REQUIRED)
add_library(shiftrig_report STATIC ${CMAKE_CURRENT_LIST_DIR}/report/report.cpp ${CMAKE_CURRENT_LIST_DIR}/report/shift_page.cpp
            ${CMAKE_BINARY_DIR}/report_page.cpp)
target_link_libraries(shiftrig_report PUBLIC shiftrig_analysis nlohmann_json::nlohmann_json)
