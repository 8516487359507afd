# The dashboard and a report in Debian's Chromium.
add_test(NAME pages_in_a_browser COMMAND ${CMAKE_SOURCE_DIR}/web/tests/run.sh $<TARGET_FILE:shiftrig>)
set_tests_properties(pages_in_a_browser PROPERTIES TIMEOUT 300)
