// How each kind of connector is drawn: its symbol, and the figure that stands at it. A kind without a line here is drawn as
// a box with its name.
#pragma once

#include <string>

#include "plant/connectors.h"

namespace shiftrig::analysis {

// Where a device stands: between masses, below the one mass it holds or loads, or above the one it drives.
enum class Place { between, hangs, stands };

struct Symbol {
    const char* word = "";  // its class in the drawing
    const char* drawn =
        "";  // SVG around (0, 0), ports at ±20 px or, where it hangs or stands, at −18 or 16 px
    const char* shape = "box";  // of Graphviz
    Place place = Place::between;
    double half_height = 16;  // [px]
};

struct Look {
    Symbol symbol;
    std::string figure;  // "41:30"
};

// A value as figures show it, four digits.
std::string digits(double value);

Look look_of(const plant::Shaft& device);
Look look_of(const plant::Backlash& device);
Look look_of(const plant::Damper& device);
Look look_of(const plant::Clutch& device);
Look look_of(const plant::Freewheel& device);
Look look_of(const plant::Gear& device);
Look look_of(const plant::Planetary& device);
Look look_of(const plant::BrixiusTyre& device);
Look look_of(const plant::TorqueConverter& device);
Look look_of(const plant::Engine& device);
Look look_of(const plant::TorqueSource& device);
Look look_of(const plant::Road& device);
Look look_of(const plant::Plough& device);

// Of any other kind.
template <class Kind>
Look look_of(const Kind& device) {
    int masses = 0;
    for (const plant::End& end : plant::ends(device)) masses += end.mass.empty() ? 0 : 1;
    if (masses > 1) return {{plant::kind(device), R"(<path d="M-20 0H-10V-9H10V9H-10V0M10 0H20"/>)"}, ""};
    return {{plant::kind(device), R"(<path d="M0 -18V-7M-10 -7H10V8H-10Z"/>)", "box", Place::hangs}, ""};
}

}  // namespace shiftrig::analysis
