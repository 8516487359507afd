// The LCM channels of the rig, each with its type and direction.
//
// Versioning: LCM puts a fingerprint of the type's fields before every message, so a peer with another
// layout is refused (and counted), never misread. Therefore a published type is not changed: a new layout
// is a new file with the next number (speeds2.lcm, SHIFTRIG_SPEEDS2), and the old channel is served beside
// it for at least one minor release. Comments may change at any time.
#pragma once

namespace shiftrig::io::channel {

// Controller → rig.
inline constexpr const char* clutch_command = "SHIFTRIG_CLUTCH_COMMAND";            // clutch_command_t
inline constexpr const char* engine_request = "SHIFTRIG_ENGINE_REQUEST";            // engine_request_t
inline constexpr const char* transmission_status = "SHIFTRIG_TRANSMISSION_STATUS";  // transmission_status_t
// An outside driver → rig.
inline constexpr const char* driver_request = "SHIFTRIG_DRIVER_REQUEST";  // driver_input_t

// Rig → all.
inline constexpr const char* driver_input = "SHIFTRIG_DRIVER_INPUT";  // driver_input_t
inline constexpr const char* speeds = "SHIFTRIG_SPEEDS";              // speeds_t
inline constexpr const char* plant_state = "SHIFTRIG_PLANT_STATE";    // plant_state_t
inline constexpr const char* plant_info = "SHIFTRIG_PLANT_INFO";      // plant_info_t

// Only in recordings (docs/recording.md).
inline constexpr const char* record_chunk = "SHIFTRIG_REC_CHUNK";      // record_chunk_t
inline constexpr const char* record_signals = "SHIFTRIG_REC_SIGNALS";  // record_signals_t
inline constexpr const char* record_event = "SHIFTRIG_REC_EVENT";      // record_event_t
inline constexpr const char* record_timing = "SHIFTRIG_REC_TIMING";    // record_timing_t
inline constexpr const char* record_gap = "SHIFTRIG_REC_GAP";          // record_gap_t
inline constexpr const char* record_tick = "SHIFTRIG_REC_TICK";        // record_tick_t
inline constexpr const char* record_end = "SHIFTRIG_REC_END";          // record_end_t

}  // namespace shiftrig::io::channel
