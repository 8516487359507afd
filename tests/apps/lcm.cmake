# The rig and its tools on LCM, as a user starts them.
add_test(NAME lcm_test COMMAND ${CMAKE_SOURCE_DIR}/tests/io/with_multicast.sh /usr/bin/python3
  ${CMAKE_CURRENT_LIST_DIR}/lcm_test.py $<TARGET_FILE:shiftrig> $<TARGET_FILE:shiftrig-tcu> ${CMAKE_SOURCE_DIR})

# Recordings replayed: scenarios × paces, overruns, faults, a killed controller (docs/recording.md: the whole of it).
add_test(NAME replay_matrix COMMAND ${CMAKE_SOURCE_DIR}/tests/io/with_multicast.sh /usr/bin/python3
  ${CMAKE_CURRENT_LIST_DIR}/replay_matrix.py $<TARGET_FILE:shiftrig> $<TARGET_FILE:shiftrig-tcu> ${CMAKE_SOURCE_DIR})
