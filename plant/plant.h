// The plant's front door: build a Model from a Description, then step it.
//
//     Model model = Model::build(description);           // or throws ModelError, naming device and rule
//     Operators operators(model);  State state(model);  Scratch scratch(model);
//     Inputs inputs(model);  Outputs outputs(model);
//     inputs.value[model.input("clutch.F1.pressure_command")] = 18e5;
//     step(model, operators, state, inputs, outputs, scratch);          // advances by model.step_size()
//
// Six roles that never mix: Model (parameters, const after build), Operators (cached matrices per mode;
// dropping them changes no bit), State (one block; its bytes are a snapshot), Inputs, Outputs, Scratch
// (nothing in it survives a step).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plant/description.h"
#include "plant/realtime.h"
#include "plant/signal.h"

namespace shiftrig::plant {

// What is wrong with a description: the device, its field and the rule, so that io/ can add file and line.
class ModelError : public std::runtime_error {
  public:
    ModelError(std::string device_kind, std::string device_name, std::string field_name,
               std::string rule_text);
    std::string kind;    // "clutch", "mass", …
    std::string device;  // "F2"
    std::string field;   // "inertia", empty if the rule is about the device as a whole
    std::string rule;    // "= -0.09; must be > 0"
};

enum class EventKind : std::uint8_t {
    // Friction pairs: closed, opened, free → slipping, no longer pressed; `reverse`, below: slipping the other way.
    lock,
    break_away,
    engage,
    release,
    // Gears and planetary rows: at rest under load, moving again, power turned round.
    mesh_sticks,
    mesh_releases,
    drive_side,
    // Several: a torque split is not unique; more changes in a step than are located.
    tie_up,
    fall_back,
    // Engines: fallen below their stall speed, running again.
    engine_stalls,
    engine_starts,
    // Facings of clutches, beyond their temperatures.
    facing_warning,
    facing_failure,
    // Shafts with play.
    flank_closes,
    flank_opens,
    // More changes in this step than it can tell.
    untold,
    reverse,
};
constexpr EventKind last_event_kind = EventKind::reverse;

// Why a state changed ([Algin] eq. (12), (13)).
struct Event {
    double time = 0;  // [s], inside the step
    EventKind kind{};
    std::int16_t device = -1;  // index into model.device_names(), −1: none
    // [Nm] on the first link; of a mesh at rest: what its loss has to take to stay so. [N] on a body that moves straight on
    double torque = 0;
    double capacity = 0;  // [Nm] static, sliding where it engages; what the loss of a mesh at rest allows
    double slip = 0;      // [rad/s]
    // By kind:
    //   lock                   +1 or −1, the sense in which it slipped until then; 0: nothing pressed it
    //   engage                 +1 or −1, the sense in which it slips, or pushes at no slip
    //   break_away, reverse    +1 or −1, the sense in which it slips from here on; 0: others hold it at rest
    //   mesh_releases          1: it only passes through rest; 2, or 3: it moves, or passes, as others let it
    //   drive_side             x
    //   flank_…                +1 or −1, which one
    //   engine_…, facing_…     speed [rad/s], temperature [°C]
    //   untold                 how many
    double value = 0;
    // tie_up: bit i of pair `device` + i, which shares the load; the last bit: so do others further away.
    std::uint64_t members = 0;
};
// Is a torque compared with a capacity in this event? Then `margin` is what is left of it, negative beyond it [Nm].
bool has_margin(EventKind kind) noexcept;
inline double margin(const Event& event) noexcept {
    return event.capacity - (event.torque < 0 ? -event.torque : event.torque);
}
constexpr int most_members = 63;

class Model;
// In words: `t=1.2034517 F2 locks: slip 0, torque 812.4 of 2569.3 Nm static`.
std::string explain(const Model& model, const Event& event);
// Does this device, as device_names() counts them, ever tell such an event?
bool tells(const Model& model, std::size_t device, EventKind kind) noexcept;

// Proof of one step, as numbers.
struct Certificate {
    enum Flag : std::int32_t { tie_up = 1, no_agreement = 2, not_finite = 4, coarse = 8, instant_lost = 16 };
    double torque_residual = 0;       // of eq. (15), relative to the torque scale
    double constraint_violation = 0;  // worst |C_Rᵀω| [rad/s]
    double energy_defect = 0;         // ΔE − in + dissipated over this step [J]
    std::int32_t events = 0;          // localised in this step
    std::int32_t fall_backs = 0;      // next-step rule used
    std::int32_t mode_lookups = 0;
    std::int32_t mode_misses = 0;  // operators built in this step
    // Bit 0: tie-up (split not unique); 1: no states or directions agreed; 2: not finite; 3: even the shortest parts that
    // Description::maximum_parts allows are coarse (docs/mechanics.md, One step); nobody looks where it is 1 or states change
    // from the next step on; 4: an instant was not found, and a state changed where the search for it ended.
    std::int32_t flags = 0;
};

enum class KernelKind { automatic, portable, avx2, avx512 };

struct BuildOptions {
    double step_size = 1e-3;  // h [s]
    KernelKind kernel = KernelKind::automatic;
    std::uint64_t seed = 1;  // of the noise of sensors
};

namespace detail {
struct ModelData;
struct OperatorsData;
struct ScratchData;
}  // namespace detail

class Model {
  public:
    // Throws ModelError.
    static Model build(const Description& description, const BuildOptions& options = {});
    Model(Model&&) noexcept;
    Model& operator=(Model&&) noexcept;
    ~Model();

    double step_size() const noexcept;
    std::uint64_t seed() const noexcept;
    std::string_view kernel() const noexcept;         // "portable", "avx2", "avx512"
    std::string_view engine() const noexcept;         // "etd3", "ark3"
    std::string_view engine_reason() const noexcept;  // why this one, in words
    const Description& description() const noexcept;

    const std::vector<Signal>& inputs() const noexcept;
    const std::vector<Signal>& outputs() const noexcept;
    int input(std::string_view name) const noexcept;                // index, or −1
    int output(std::string_view name) const noexcept;               // index, or −1
    const std::vector<std::string>& device_names() const noexcept;  // as Event::device counts them

    std::size_t state_size() const noexcept;  // [bytes]

    const detail::ModelData& data() const noexcept { return *data_; }

  private:
    explicit Model(std::unique_ptr<detail::ModelData> data);
    std::unique_ptr<detail::ModelData> data_;
};

struct Inputs {
    explicit Inputs(const Model& model);  // every input at its Signal::initial
    std::vector<double> value;            // by model.input(name); held over the step
};

struct Outputs {
    static constexpr int event_capacity = 64;
    explicit Outputs(const Model& model);
    std::vector<double> value;  // by model.output(name), at the end of the step
    Certificate certificate;
    int event_count =
        0;  // of this step; beyond the capacity they are only counted, the last one kept says how many
    std::array<Event, event_capacity> events;
};

class State {
  public:
    explicit State(const Model& model);   // the description's initial state, joined onto its locked devices
    std::int64_t steps() const noexcept;  // since start
    double time() const noexcept;         // steps·h, never accumulated
    std::span<const double> speeds() const noexcept;  // ω of each mass, description order [rad/s] or [m/s]
    std::span<const double> twists() const noexcept;  // of each shaft [rad]
    std::span<const std::byte> bytes() const noexcept;
    // Is the block one of this model's? Its size, masses, twists and step are, and there are such contact states, places in
    // delay lines and modes of engines.
    bool is_of(const Model& model) const noexcept;
    // False (and unchanged) if bytes() of a state of this model are something else.
    bool restore(const Model& model, std::span<const std::byte> bytes);

    std::vector<double> block;  // layout in plant/state_layout.h
};

class Operators {
  public:
    explicit Operators(const Model& model);
    ~Operators();
    Operators(Operators&&) noexcept;
    Operators& operator=(Operators&&) noexcept;
    void drop() noexcept;  // forget every cached mode; the next step rebuilds, bit for bit
    detail::OperatorsData& data() noexcept { return *data_; }

  private:
    std::unique_ptr<detail::OperatorsData> data_;
};

class Scratch {
  public:
    explicit Scratch(const Model& model);
    ~Scratch();
    Scratch(Scratch&&) noexcept;
    Scratch& operator=(Scratch&&) noexcept;
    void fill_with_nan() noexcept;  // for the test that nothing in it survives a step
    detail::ScratchData& data() noexcept { return *data_; }

  private:
    std::unique_ptr<detail::ScratchData> data_;
};

// One step of model.step_size(). Never throws, allocates or blocks.
void step(const Model& model, Operators& operators, State& state, const Inputs& inputs, Outputs& outputs,
          Scratch& scratch) SHIFTRIG_REALTIME;

// Fills `outputs.value` from the state as it is (before the first step).
void observe(const Model& model, Operators& operators, const State& state, const Inputs& inputs,
             Outputs& outputs, Scratch& scratch) SHIFTRIG_REALTIME;

// A state in motion: the named devices locked, the given mass speeds taken, all others following through
// locked devices, gears, (untwisted) shafts and rolling tyres; actuators at rest at the values of `inputs`.
struct Start {
    std::vector<std::string> locked;
    std::vector<std::pair<std::string, double>> speeds;
};
// Throws ModelError where a name is none of the model's, or speeds contradict each other.
void start(const Model& model, State& state, const Start& start, const Inputs& inputs);

// Its certificate's signals anew, where somebody sums up several steps.
void show_certificate(Outputs& outputs) SHIFTRIG_REALTIME;

// Time 0 is now: steps, ways, heat and the energy account count from here on, the motion is as it was.
void begin_account(const Model& model, State& state) noexcept;

}  // namespace shiftrig::plant
