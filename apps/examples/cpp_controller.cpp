// A shift controller in a few lines of C++ on the project's CAN library: follows the lever, one clutch handing over to
// the next. It knows signals by the names of config/can/tractor.yaml; the link makes frames of them.
//
//     cpp_controller can:vcan0 [MAPPING]
//     cpp_controller udpcan:239.74.163.2:43113 [MAPPING]
#include <algorithm>
#include <cmath>
#include <iostream>

#include "io/can/link.h"
#include "io/can/mapping.h"
#include "io/can/open_port.h"

using namespace shiftrig::io;

namespace {

// [Pa] in a clutch, t seconds after the change of gear was asked for.
double oncoming(double t) {
    const double share = std::clamp((t - 0.12) / 0.08, 0.0, 1.0);  // of the torque that has been handed over
    return t < 0.10 ? 4e5 : share < 1 ? 1.2e5 + share * 7.8e5 : 11e5;
}
double offgoing(double t) {
    return t < 0.12 ? 18e5 : 9e5 * std::clamp((0.20 - t) / 0.08, 0.0, 1.0);
}

}  // namespace

int main(int argc, char** argv) try {
    if (argc < 2) throw std::invalid_argument("usage: cpp_controller BUS [MAPPING]");
    const can::Mapping mapping = can::read_mapping(argc > 2 ? argv[2] : "config/can/tractor.yaml");
    const auto port = can::open_port(argv[1], can::filters_of(mapping, can::Role::controller));
    SignalTable signals;
    can::CanLink link(
        mapping, *port, signals,
        {.role = can::Role::controller, .address_claim = can::AddressClaim::claim, .tick_ns = 10'000'000});
    link.claim_addresses();
    const auto value = [&signals](const std::string& name) -> double& {
        return signals.value.at(static_cast<std::size_t>(signals.find(name)));
    };
    std::cout << "listening" << std::endl;

    double gear = NAN, target = NAN, began = 0;
    for (std::int64_t now_ns = 0;;) {
        port->wait(1'000'000'000);
        link.receive(now_ns, signals);
        const double lever = value("driver.lever");
        if (!link.question_pending() || std::isnan(lever)) continue;  // the rig asks every 10 ms of its time
        now_ns += 10'000'000;
        const double now = 1e-9 * static_cast<double>(now_ns);
        if (std::isnan(gear)) gear = target = lever;  // at the start: stay in the gear asked for
        if (gear == target && lever != target) target = lever, began = now;
        if (gear != target && now - began > 0.6) gear = target;
        constexpr std::pair<int, const char*> kClutches[] = {
            {1, "F1"}, {2, "F2"}, {3, "F3"}, {4, "F4"}, {-1, "FR"}};
        for (const auto& [of_gear, clutch] : kClutches)
            value(std::string("clutch.") + clutch + ".pressure_command") =
                gear == of_gear && gear == target ? 18e5
                : gear == of_gear                 ? offgoing(now - began)
                : target == of_gear               ? oncoming(now - began)
                                                  : 0;
        value("controller.selected_gear") = target;
        value("controller.current_gear") = gear;
        link.send(now_ns, signals);
    }
} catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 2;
}
