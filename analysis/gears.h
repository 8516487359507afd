// The gears of a machine as the scorecard needs them: which clutches choose a gear, between which masses a
// gear's ratio is measured, and what the ratio is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "plant/description.h"

namespace shiftrig::analysis {

struct Gear {
    std::string name;                    // of the gear path
    std::vector<std::string> selecting;  // its clutches that are not closed in every gear (F2)
    std::vector<std::string> common;     // its clutches that are (Fc); freewheels are in neither list
    // The ratio is measured across the gearbox proper, where no shaft's twist falsifies it: between the masses
    // nearest to the machine's input and output that are joined rigidly with the selecting clutches in this gear.
    std::string in, out;
    std::optional<double>
        ratio;  // ω_in/ω_out; none if the closed clutches leave it open, or out stands still
};

// In the order of description.gear_paths. Throws plant::ModelError where the description is not a machine.
std::vector<Gear> gears_of(const plant::Description& description);

// By how much a clutch slips per speed that the gearbox's input runs ahead of its output, on the way from one gear to
// another, where only the clutches of both hold: 1 from the input to a wheel on the output, −1 where the same clutch
// is written the other way around. None where the other open clutches have a say in it.
std::optional<double> slip_per_input_speed(const plant::Description& description, const Gear& from,
                                           const Gear& to, const std::string& clutch);

}  // namespace shiftrig::analysis
