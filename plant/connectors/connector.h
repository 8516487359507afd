// What every kind of connector is asked. A kind has one header and one source in this folder: its parameters (what a
// Description holds of it), its law where that is its own, and its answers, as overloads of the functions below. The list
// of kinds stands in plant/connectors.h; whoever needs something of all of them goes through it and asks, so that validation,
// structure, model, outputs, events and statics know none of them by name. What `check` says beside that does:
// resolution.cpp, modal.cpp, warnings.cpp.
//
// No answer is virtual, and nothing is looked up at run time: which one is meant is settled when the program is compiled.
#pragma once

#include <string>
#include <vector>

#include "plant/realtime.h"

namespace shiftrig::plant {

class Check;         // check.h
class Assembly;      // assembly.h
struct Description;  // description.h
struct Event;        // plant.h
namespace detail {
class ModelBuilder;  // model_builder.h
struct Shown;        // shown.h
}  // namespace detail

enum class Motion { rotating, translating };

// How the mass at a link has to move.
enum class EndMotion {
    any,
    rotating,     // an inertia
    translating,  // a body
    alike,        // as the one at the first link does: nothing converts between them
};

// One link of a connector: the member of its struct that names the mass.
struct End {
    const char* field;
    const std::string& mass;
    bool may_be_housing = false;  // where it is empty
    const char* role = "";        // in a drawing, where the ends are not alike
    EndMotion motion = EndMotion::any;
};

// ---- what each kind has to answer
//
//     const char* kind(const Kind&)                        the word for it in error lines
//     std::array<End, n> ends(const Kind&)                 its links
//     void check_parameters(const Check&, const Kind&)     throws ModelError where a parameter breaks a rule; its links are
//                                                          looked at for all kinds alike
//
// ---- what it may answer; below is the answer of a kind that has nothing to say

// What it needs of the rest of the machine; throws ModelError where that is missing.
template <class Kind>
void check_surroundings(const Description&, const Kind&) {}

// Its columns in the distribution matrix: pairs, meshes, shafts, dampers.
template <class Kind>
void assemble(Assembly&, const Kind&) {}

// May a gear path or a question of statics name it among the closed ones?
template <class Kind>
bool may_be_closed(const Kind&) {
    return false;
}

// Said to be closed, what would it do instead of passing on this torque [Nm] on its first link: "overruns"? Null where it
// does pass it on, up to a tolerance [Nm].
template <class Kind>
const char* beyond_limit(const Kind&, double /*torque*/, double /*tolerance*/) {
    return nullptr;
}

// The law of its friction pair, with inputs that command it. Asked of all kinds before add_law().
template <class Kind>
void add_pair_law(detail::ModelBuilder&, const Kind&) {}

// Any other law of it, the masses it pushes, its inputs.
template <class Kind>
void add_law(detail::ModelBuilder&, const Kind&) {}

// Names and units of the outputs of all devices of the kind,
template <class Kind>
void name_outputs(detail::ModelBuilder&, const std::vector<Kind>&) {}

// and their values at the end of a step, in the same order. Returns where the next kind writes.
template <class Kind>
double* show(const detail::Shown&, const std::vector<Kind>&, double* next) SHIFTRIG_REALTIME {
    return next;
}

// An event of the device in its own words, behind time and name; empty: in those common to all (explain.cpp).
template <class Kind>
std::string in_words(const Kind&, const Event&) {
    return {};
}

}  // namespace shiftrig::plant
