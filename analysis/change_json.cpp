#include "analysis/change_json.h"

#include <nlohmann/json.hpp>

#include "io/recording/event_json.h"

namespace shiftrig::analysis {

nlohmann::json to_json(const Change& change) {
    nlohmann::json json = {{"time_s", change.event.time}, {"device", change.device}};
    if (!change.device.empty())
        json = io::event_json(change.event, change.device, change.members);
    else if (change.of_machine())
        json["count"] = change.event.value;  // of what is untold
    json["kind"] = change.kind;
    json["text"] = change.text;
    return json;
}

}  // namespace shiftrig::analysis
