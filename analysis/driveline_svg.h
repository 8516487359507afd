// The driveline as one SVG drawing: masses, devices with their ratios, and the gear table if asked for.
//
// A page can bring it to life: every mass is a <g id="mass-NAME" class="mass">, every device a
// <g id="device-NAME" class="device KIND">, each with an empty <text class="value">; a friction device takes
// the classes open, slipping, locked. Colours come from the page's variables --ink, --paper, --muted, --open,
// --slipping, --locked where it has them.
#pragma once

#include <string>

#include "plant/description.h"

namespace shiftrig::analysis {

std::string driveline_svg(const plant::Description& machine, bool with_gear_table = false);

}  // namespace shiftrig::analysis
