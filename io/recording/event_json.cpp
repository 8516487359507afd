#include "io/recording/event_json.h"

#include "io/recording/event_names.h"

namespace shiftrig::io {

std::vector<std::string> loop_members(const plant::Event& event, const std::vector<std::string>& devices) {
    std::vector<std::string> names;
    for (int i = 0; i < plant::most_members; ++i) {
        if (event.members >> i & 1) names.push_back(devices.at(static_cast<std::size_t>(event.device + i)));
    }
    return names;
}

nlohmann::json event_json(const plant::Event& event, const std::string& device,
                          const std::vector<std::string>& members) {
    using K = plant::EventKind;
    nlohmann::json json{
        {"time_s", event.time},      {"kind", name(event.kind)},      {"device", device},
        {"torque_nm", event.torque}, {"capacity_nm", event.capacity}, {"slip_rad_s", event.slip}};
    if (plant::has_margin(event.kind)) json["margin_nm"] = plant::margin(event);
    switch (event.kind) {
        case K::drive_side:
            json["x"] = event.value;
            break;
        case K::flank_closes:
        case K::flank_opens:
            json["flank"] = event.value;
            break;
        case K::engine_stalls:
        case K::engine_starts:
            json["speed_rad_s"] = event.value;
            break;
        case K::facing_warning:
        case K::facing_failure:
            json["temperature_degc"] = event.value;
            break;
        case K::mesh_releases:
            json["passes_through"] = event.value == 1 || event.value == 3;
            json["with_others"] = event.value >= 2;
            if (event.value >= 2) json.erase("margin_nm");
            break;
        case K::untold:
            json["count"] = event.value;
            break;
        case K::tie_up:
            json["members"] = members;
            break;
        default:
            break;
    }
    return json;
}

}  // namespace shiftrig::io
