# The whole bench: in one process, and as programs on real buses.
add_executable(rig_test ${CMAKE_CURRENT_LIST_DIR}/rig_test.cpp)
target_link_libraries(rig_test PRIVATE shiftrig_rig GTest::gtest_main)
target_compile_definitions(rig_test PRIVATE SHIFTRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
gtest_discover_tests(rig_test DISCOVERY_TIMEOUT 60)

set(SHIFT ${CMAKE_SOURCE_DIR}/config/scenarios/plough_upshift.yaml)
set(TWO_PROCESSES /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/two_processes_test.py
  $<TARGET_FILE:shiftrig> $<TARGET_FILE:shiftrig-tcu> ${SHIFT})
add_test(NAME two_processes_on_vcan COMMAND ${TWO_PROCESSES} can:vcan0)
set_tests_properties(two_processes_on_vcan PROPERTIES LABELS vcan)
set(MULTICAST ${CMAKE_SOURCE_DIR}/tests/io/with_multicast.sh)
add_test(NAME two_processes_on_lcm COMMAND ${MULTICAST} ${TWO_PROCESSES} lcm:udpm://239.255.76.67:7667?ttl=0)
add_test(NAME two_processes_on_udpcan COMMAND ${MULTICAST} ${TWO_PROCESSES} udpcan:239.74.163.2:43113)

foreach(subject run_command bad_input told_events)
  add_test(NAME ${subject}_test COMMAND /usr/bin/python3 ${CMAKE_CURRENT_LIST_DIR}/${subject}_test.py
    $<TARGET_FILE:shiftrig> $<TARGET_FILE:shiftrig-tcu> ${CMAKE_SOURCE_DIR}/config)
endforeach()
