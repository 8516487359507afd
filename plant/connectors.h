// Every kind of connector, once. Whoever needs something of all of them goes through this list and asks what
// connectors/connector.h says can be asked: a new kind is one line here and one member of Description.
#pragma once

#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "plant/description.h"

namespace shiftrig::plant {

// Their outputs stand in this order; those of translating bodies stand between the two parts.
inline auto driveline_kinds(const Description& d) {
    return std::tie(d.shafts, d.dampers, d.clutches, d.freewheels, d.backlashes, d.gears, d.planetaries,
                    d.tyres, d.converters, d.engines, d.sources);
}
inline auto load_kinds(const Description& d) {
    return std::tie(d.roads, d.ploughs);
}
inline auto all_kinds(const Description& d) {
    return std::tuple_cat(driveline_kinds(d), load_kinds(d));
}

// Calls with the vector of each kind.
template <class Kinds, class Function>
void for_each_kind(const Kinds& kinds, const Function& function) {
    std::apply([&](const auto&... devices) { (function(devices), ...); }, kinds);
}

// Calls with every connector of the machine, kind by kind.
template <class Function>
void for_each_connector(const Description& d, const Function& function) {
    for_each_kind(all_kinds(d), [&](const auto& devices) {
        for (const auto& device : devices) function(device);
    });
}

// Place of a kind in the list.
template <class Kind, class... Vectors>
constexpr std::size_t place_in(const std::tuple<Vectors...>*) {
    std::size_t place = 0;
    bool found = false;
    ((found = found || std::is_same_v<Vectors, const std::vector<Kind>&>, place += found ? 0 : 1), ...);
    return place;
}
using AllKinds = decltype(all_kinds(std::declval<const Description&>()));
constexpr std::size_t connector_kinds = std::tuple_size_v<AllKinds>;
template <class Kind>
constexpr std::size_t place_of = place_in<Kind>(static_cast<const AllKinds*>(nullptr));

}  // namespace shiftrig::plant
