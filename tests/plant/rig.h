// A model with all its roles, for tests that step it.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "plant/plant.h"
#include "tests/plant/parts.h"

namespace shiftrig::plant {

struct Rig {
    explicit Rig(const Description& description, const BuildOptions& options = {})
        : model(Model::build(description, options)),
          operators(model),
          state(model),
          scratch(model),
          inputs(model),
          outputs(model) {}

    double& in(const std::string& name) { return inputs.value[at(model.input(name), name)]; }
    double out(const std::string& name) const { return outputs.value[at(model.output(name), name)]; }
    void step() {
        plant::step(model, operators, state, inputs, outputs, scratch);
        for (int i = 0; i < std::min(outputs.event_count, Outputs::event_capacity); ++i) {
            const Event& event = outputs.events[static_cast<std::size_t>(i)];
            events.push_back(event);
            if (event.device < 0) continue;
            EXPECT_TRUE(tells(model, static_cast<std::size_t>(event.device), event.kind))
                << explain(model, event);
        }
        fall_backs += outputs.certificate.fall_backs;
        flags |= outputs.certificate.flags;
    }
    void run(double until) {
        while (state.time() < until - 1e-9) step();
    }
    // Times at which a device had events of one kind.
    std::vector<double> times(EventKind kind, const std::string& device) const {
        std::vector<double> list;
        for (const Event& event : events) {
            if (event.kind == kind && event.device >= 0 &&
                model.device_names()[static_cast<std::size_t>(event.device)] == device) {
                list.push_back(event.time);
            }
        }
        return list;
    }

    Model model;
    Operators operators;
    State state;
    Scratch scratch;
    Inputs inputs;
    Outputs outputs;
    std::vector<Event> events;
    int fall_backs = 0;
    int flags = 0;

  private:
    static std::size_t at(int index, const std::string& name) {
        if (index < 0) throw std::runtime_error("no signal " + name);
        return static_cast<std::size_t>(index);
    }
};

// A reference curve: column name → values, one row per millisecond.
inline std::map<std::string, std::vector<double>> read_reference(const std::string& name) {
    std::ifstream file(std::string(SHIFTRIG_TEST_DATA) + "/" + name);
    std::string line, cell;
    std::getline(file, line);
    std::vector<std::string> header;
    for (std::istringstream row(line); std::getline(row, cell, ',');) header.push_back(cell);
    std::map<std::string, std::vector<double>> columns;
    while (std::getline(file, line)) {
        std::istringstream row(line);
        for (std::size_t i = 0; std::getline(row, cell, ','); ++i)
            columns[header[i]].push_back(std::stod(cell));
    }
    return columns;
}

}  // namespace shiftrig::plant
