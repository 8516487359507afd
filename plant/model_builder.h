// A Model under construction: what connectors add their laws, inputs and outputs to (connectors/connector.h). Internal to
// plant/.
#pragma once

#include <string>
#include <vector>

#include "plant/model_data.h"

namespace shiftrig::plant::detail {

class ModelBuilder {
  public:
    explicit ModelBuilder(ModelData& data) : model(data) {}

    ModelData& model;  // description and structure are complete, and everything that follows from them alone

    // Index of an input; several devices may share one, with the same initial value and range.
    int input(const std::string& name, Unit unit, double initial, double minimum, double maximum,
              const std::string& description);
    // 0 or 1.
    int flag(const std::string& name, const std::string& description);
    void output(const std::string& name, Unit unit, const std::string& description);

    // What acts on this mass, its speed and its way: Nm, rad/s and rad, or N, m/s and m where it moves straight on.
    Unit effort_unit(const std::string& mass) const {
        return is_straight(mass) ? Unit::newton : Unit::newton_metre;
    }
    Unit speed_unit(const std::string& mass) const {
        return is_straight(mass) ? Unit::metre_per_second : Unit::radian_per_second;
    }
    Unit way_unit(const std::string& mass) const { return is_straight(mass) ? Unit::metre : Unit::radian; }

    // Index and law of the friction pair that a device put into the structure under this name. −1: there is none.
    int pair(const std::string& name) const { return model.structure.pair(name); }
    PairLaw& law(int pair) { return model.pair_laws[static_cast<std::size_t>(pair)]; }

    // A torque or force on a mass, positive into it: index into f. Who pushes the same mass adds to the same one.
    int external(int mass);

    // Times at which something jumps, so that no step reaches across them.
    void breakpoints(const Waveform& waveform);

    // Room in the State block for an actuator.
    int actuator(int slots) { return std::exchange(actuator_slots, actuator_slots + slots); }
    // A device that tells events without being a pair, a mesh or a backlash.
    void tells_events(const std::string& device) { tellers.push_back(device); }

    int actuator_slots = 0;
    std::vector<std::string> tellers;

  private:
    bool is_straight(const std::string& mass) const {
        const auto j = static_cast<std::size_t>(model.structure.mass(mass));
        return model.description.masses[j].motion == Motion::translating;
    }
};

}  // namespace shiftrig::plant::detail
