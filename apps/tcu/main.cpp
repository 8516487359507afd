// shiftrig-tcu: the reference controller as a program of its own, on any bus.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <iostream>

#include "apps/tcu/node.h"
#include "io/input_error.h"
#include "rt/clock.h"

namespace {

volatile std::sig_atomic_t stop = 0;

void on_signal(int) {
    stop = 1;
}

}  // namespace

int main(int argc, char** argv) {
    using namespace shiftrig;
    CLI::App app{"shiftrig-tcu: the reference shift controller", "shiftrig-tcu"};
    std::string bus, calibration_file = SHIFTRIG_CONFIG "/calibration/tractor.yaml";
    bool lockstep = false;
    app.add_option("--bus", bus, "can:INTERFACE | udpcan:ADDRESS:PORT | lcm:URL")->required();
    app.add_option("--calibration", calibration_file, "what it believes about the machine")
        ->capture_default_str();
    app.add_flag("--lockstep", lockstep,
                 "count time by the rig's questions, as fast as they come (the rig: --pace lockstep)");
    app.footer("Ends with SIGINT or SIGTERM. Exit codes: 0 good, 2 wrong usage or bad input.");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }

    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    try {
        const auto calibration = tcu::read_calibration(calibration_file);
        const auto mapping = io::can::read_mapping(calibration.bus.mapping);
        tcu::Node node(calibration, bus, &mapping, lockstep);
        std::cerr << "shiftrig-tcu: on " << bus << '\n';
        const rt::SteadyClock clock;
        while (!stop) {
            node.bus().wait(1'000'000);
            node.tick(clock.now());
        }
        return 0;
    } catch (const io::InputError& error) {  // names its place itself
        std::cerr << error.what() << '\n';
    } catch (const std::exception& error) {
        std::cerr << "shiftrig-tcu: " << error.what() << '\n';
    }
    return 2;
}
