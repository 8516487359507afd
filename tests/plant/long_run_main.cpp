// Runs of very many steps with all losses on: does anything creep? By hand with --steps 100000000 --parked 10000000;
// the suite takes a short slice.
//
//   driving   the reference tractor ploughs in F2 at full speed: the worst constraint violation of all steps
//   parked    it stands on a 15 % grade with the brake on: the way from a minute after the stop on
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>

#include "io/model_file.h"
#include "plant/plant.h"

namespace shiftrig::plant {
namespace {

constexpr double most_violation = 3 * 6e-14;  // three times what a prototype reached [rad/s]

struct Tractor {
    Tractor()
        : model(Model::build(io::read_model(SHIFTRIG_CONFIG "/tractor.yaml").description)),
          operators(model),
          state(model),
          scratch(model),
          inputs(model),
          outputs(model) {}
    void set(const char* name, double value) {
        inputs.value[static_cast<std::size_t>(model.input(name))] = value;
    }
    double get(const char* name) const { return outputs.value[static_cast<std::size_t>(model.output(name))]; }
    void advance(std::int64_t steps) {
        for (std::int64_t n = 0; n < steps; ++n) {
            step(model, operators, state, inputs, outputs, scratch);
            worst_violation = std::fmax(worst_violation, outputs.certificate.constraint_violation);
            flags |= outputs.certificate.flags & 4;
        }
    }

    Model model;
    Operators operators;
    State state;
    Scratch scratch;
    Inputs inputs;
    Outputs outputs;
    double worst_violation = 0;
    int flags = 0;
};

bool drives(std::int64_t steps) {
    Tractor tractor;
    tractor.set("driver.throttle", 0.73);
    tractor.set("environment.draft", 1);
    tractor.set("clutch.F2.pressure_command", 18e5);
    start(tractor.model, tractor.state, {{"Fc", "F2"}, {{"engine", 188.6}}}, tractor.inputs);
    tractor.advance(steps);
    std::printf("driving: %lld steps, worst constraint violation %.2g rad/s, input %.1f rad/s at the end\n",
                static_cast<long long>(steps), tractor.worst_violation, tractor.get("mass.input.speed"));
    return tractor.worst_violation < most_violation && tractor.flags == 0 &&
           tractor.get("mass.input.speed") > 150;
}

bool stands(std::int64_t steps) {
    Tractor tractor;
    tractor.set("driver.throttle", 0.3);
    tractor.set("environment.grade", 0.15);
    start(tractor.model, tractor.state, {{"Fc"}, {{"engine", 120}}}, tractor.inputs);
    tractor.set("driver.brake", 1);
    tractor.advance(65'000);
    const double from = tractor.get("body.vehicle.distance");
    tractor.advance(steps);
    const double moved = std::fabs(tractor.get("body.vehicle.distance") - from);
    std::printf("parked: %lld steps on a 15 %% grade, moved %.2g m, worst constraint violation %.2g rad/s\n",
                static_cast<long long>(steps), moved, tractor.worst_violation);
    return moved < 1e-9 && tractor.worst_violation < most_violation && tractor.flags == 0;
}

}  // namespace
}  // namespace shiftrig::plant

int main(int argc, char** argv) {
    std::int64_t steps = 1'000'000, parked = 100'000;
    for (int i = 1; i < argc; i += 2) {
        std::int64_t* value = !std::strcmp(argv[i], "--steps")    ? &steps
                              : !std::strcmp(argv[i], "--parked") ? &parked
                                                                  : nullptr;
        const char* text = i + 1 < argc ? argv[i + 1] : "";
        const auto [end, error] = std::from_chars(text, text + std::strlen(text), value ? *value : steps);
        if (!value || error != std::errc{} || *end != 0 || *value < 0) {
            std::fprintf(stderr, "usage: shiftrig_long_run [--steps N] [--parked N]\n");
            return 2;
        }
    }
    const bool driving = shiftrig::plant::drives(steps), parking = shiftrig::plant::stands(parked);
    return driving && parking ? 0 : 1;
}
