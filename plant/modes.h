// One contact mode = one linear system, and its operators for a step of any length. Internal to plant/.
//
//   ω̇ = B M̃,  B = Π₀ J⁻¹(I − Ĉ T̂),   M_R = T̂ M̃,   M̃ = S f − A_E (K φ + D A_Eᵀ ω)      [Algin] eq. (14), (15)
//   ż = L q + S̃ f,  M_R = R_q q + R_f f
//
// with R the active rigid set (locked pairs, meshes, stuck meshes), C its kinematic and Ĉ its force columns, Π₀ the
// projection onto the speeds that it allows, A_E the columns of shafts.
//
// The speeds that the rigid set leaves free, with the twists, are the coordinates q of the mode; z = E q. The
// state stays z, of one layout in all modes; q is read out of it, and whatever comes from q lies on the constraints.
//
// T̂ = G⁺ Qᵀ J^(−1/2), G = Qᵀ J^(−1/2) Ĉ, and Q an orthonormal basis of J^(−1/2) C: dependent rows (tie-up)
// fall away by themselves; G⁺ is then the minimum-norm inverse weighted with the nominal capacities, of meshes
// Structure::mesh_weight(), of losses at rest 1e-10 of that.
#pragma once

#include <cstdint>
#include <vector>

#include "plant/contact.h"
#include "plant/contact_table.h"
#include "plant/laws/sensor.h"
#include "plant/model_data.h"
#include "plant/samples.h"
#include "plant/sparse_exponential.h"

namespace shiftrig::plant::detail {

// Bits of Mode::bound: why a pair does not slip, a mesh does not move.
enum Bound : unsigned char {
    held_in_set =
        1,  // the active set, meshes at rest among it, leaves its slip no freedom: also of what is in that set itself
    shares_load = 2,  // locked pair whose torque is not unique: it is in a loop of closed devices
};

// x of a mesh by its byte of Mode::key; one at rest has no loss.
constexpr int key_exponent(unsigned char key) noexcept {
    return key == 0 ? 0 : key == 2 ? -1 : 1;
}

struct Mode {
    std::uint64_t last_use = 0;      // 0: empty
    unsigned char* key = nullptr;    // per pair 1 locked; per mesh 0 stuck, 1 x = +1, 2 x = −1; per
                                     // shaft with play 1 closed
    unsigned char* bound = nullptr;  // per pair and mesh: bits of Bound
    int* rows = nullptr;             // active torque row → unknown (pair, mesh, loss of mesh)
    std::array<Link, 3>* row_links = nullptr;  // their kinematic columns
    int row_count = 0;
    int first_mesh = 0;            // row of the first mesh: all meshes stand there, in their order
    int base_rank = 0;             // of locked pairs and meshes
    int rank = 0;                  // with stuck meshes
    bool rests = false;            // some lossy mesh is at rest, stuck or bound
    bool redundant = false;        // more unknowns than independent rows: the split is not unique
    bool wedges = false;           // others hold a pair at no slip that is not locked itself
    int* loop = nullptr;           // per pair: in which loop of closed devices it shares a load, 0 none
    double* basis = nullptr;       // Q, masses × rank
    int order = 0;                 // number of coordinates
    int* coordinates = nullptr;    // q_i = z[coordinates[i]]
    double* loss_share = nullptr;  // per mesh: power lost = share·M_1·turning, 1 − û/u; 0 where at rest
    double* family_mobility =
        nullptr;  // per mesh: 1/√(reduced inertia) of its motion; negative: not yet asked for
    signed char* relations = nullptr;  // meshes × contact bytes: which devices at rest turn with it
    double* view = nullptr;            // E and all slips   panels, seen × order
    double* mobility = nullptr;        // B                 panels, masses × masses
    double* rates = nullptr;           // [L S̃]             panels, states × (order + forces)
    double* torques =
        nullptr;  // [R_q R_f]         panels, (rows + translating) × (order + forces); the latter
                  //                   are accelerations
    double* force_torques = nullptr;  // R_f alone              panels, rows + translating × forces
    double* balance = nullptr;  // C_Rᵀ J⁻¹ (M̃ − Ĉ M_R), in torques  panels, rows × (order + forces + rows)
    StepOperators step;    // for the model's step size; of length 0 until make_ready()
    int ledger_parts = 1;  // into how many parts the ledger divides a step: shafts and dampers are fast
    StepOperators ledger;  // for one of them
    StepOperators* ledger_of_level = nullptr;  // for shorter ones at its beginning (ledger.h)
    double *step_memory = nullptr, *ledger_memory = nullptr;
    // [L S̃] of the coordinates in energy variables, padded(order) × (order + forces), ‖L‖₁ of these [1/s], and per coordinate
    // its scale, then the reciprocals: from these the operators of any length are built.
    double *scaled_rates = nullptr, *energy_root = nullptr;
    double rate_norm = 0;
    SparseRates sparse_rates;  // L of these once more, where that is large and almost empty
    TreeMode* tree = nullptr;  // instead of all matrices, on the engine for long chains
};

// Does the shaft act in the mode, or are its flanks open?
inline bool is_shaft_closed(const ModelData& m, const Mode& mode, int shaft) noexcept {
    return shaft < m.plain_shafts || mode.key[m.first_flank + shaft - m.plain_shafts] != 0;
}

// Room that a mode and its operators take, in doubles and ints.
struct ModeSizes {
    int basis = 0, view = 0, mobility = 0, rates = 0, scaled_rates = 0, energy_root = 0, torques = 0,
        force_torques = 0, balance = 0, operators = 0, levels = 0, sparse_rates = 0;
    explicit ModeSizes(const ModelData& model);
    int doubles() const noexcept {
        return basis + view + mobility + rates + scaled_rates + energy_root + torques + force_torques +
               balance + 2 * operators + levels + sparse_rates;
    }
};

// Doubles and ints of working memory that build_mode and build_step_operators need.
int workspace_doubles(const ModelData& model) noexcept;
int workspace_integers(const ModelData& model) noexcept;

void mode_key(const ModelData& model, const unsigned char* contact, unsigned char* key) SHIFTRIG_REALTIME;

// Coordinates, view, and the operators that multiply them, from [L S̃] and [R_z R_f] over [z; f] (column-major).
void build_coordinates(const ModelData& model, Mode& mode, const double* motion, const double* torque,
                       double* workspace, int* integers) SHIFTRIG_REALTIME;
int coordinates_workspace(const ModelData& model) noexcept;

// Mode::loss_share from its key and bound bits.
void set_loss_shares(const ModelData& model, Mode& mode) SHIFTRIG_REALTIME;

bool wedges(const ModelData& model, const Mode& mode) SHIFTRIG_REALTIME;  // Mode::wedges

// Mode::row_links from its rows, and Mode::rests.
void list_row_links(const ModelData& model, Mode& mode) SHIFTRIG_REALTIME;

// Mode::scaled_rates with its norm, energy_root and sparse_rates, from its view and rates.
void scale_rates(const ModelData& model, Mode& mode) SHIFTRIG_REALTIME;

// Everything of a mode but its step operators. `mode.key` is set by the caller.
void build_mode(const ModelData& model, Mode& mode, double* workspace, int* integers) SHIFTRIG_REALTIME;

// The operators of one step of `length` in the mode, in `memory` of ModeSizes::operators doubles.
StepOperators build_step_operators(const ModelData& model, const Mode& mode, double length, double* memory,
                                   double* workspace, int* integers) SHIFTRIG_REALTIME;

// What the inputs say of a pair, as long as they stay the same.
struct PairCommand {
    double target = 0;        // where its actuator goes: pressure [Pa], current [A] or share [1]
    double scale = 1;         // leak: share of the chamber pressure that is left
    bool fixed = false;       // stuck open or closed: its load is rest_loads' whatever the actuator does
    bool valve_held = false;  // the valve sticks
    double rest =
        0;  // where valve and chamber come to rest [Pa]; not a number: nobody asks (solenoid, or held)
};

// The cache: a table of bounded size, least recently used goes.
struct OperatorsData {
    explicit OperatorsData(const ModelData& model);
    AlignedDoubles memory;
    std::vector<unsigned char> bytes, keys;
    std::vector<int> integers, row_memory;
    std::vector<std::array<Link, 3>> link_memory;
    std::vector<double> share_memory;
    std::vector<signed char> relation_memory;
    std::vector<StepOperators> level_operators;
    std::vector<Mode> modes;
    std::vector<TreeMode> trees;  // one per mode where the model has a tree
    std::vector<TreeMass> tree_masses;
    std::vector<TreeForce> tree_forces;
    std::vector<TreeEdge> tree_edges;
    std::uint64_t clock = 0;
    const Mode* in_force = nullptr;             // not forgotten while other contact states are tried
    Mode* recent = nullptr;                     // the last one found,
    std::vector<unsigned char> recent_contact;  // for these contact states
    std::vector<unsigned char> wanted;          // key being looked up
    std::vector<std::uint64_t> hashes;          // of the modes' keys
    // Inputs as they act and what follows from them alone; kept as long as the inputs are the same bits.
    std::vector<double> raw_input, input;
    std::vector<PairCommand> commands;
    std::vector<double> rest_loads;  // per pair: its load where its actuator has arrived at the command [Nm]
    std::vector<SensorFaults> sensor_faults;
    bool teeth_missing = false, sensors_disturbed = false;  // some of them
    std::vector<double> source_inputs;                      // [Nm]
    std::vector<TyreSoil> soils;
    std::vector<EngineSetting> engine_settings;
    std::vector<double> grade_forces;  // per road [N]
    double draft = 1;                  // share of the plough in the ground
    ContactTable table;
    bool inputs_known = false;
    // The samples a step begins and ends with. The end of one is the beginning of the next: carried over where
    // State and inputs prove to be those it was computed from. `first` is the one to begin with.
    AlignedDoubles sample_memory;
    Sample samples[2];
    int first = 0;
    bool carried = false;
    std::vector<double> carried_engines;  // of the State block
    double carried_energy = 0;            // stored in it [J]

    // Hydraulic operators by oil temperature, a pure function of it and h.
    double oil_temperature = 0;
    bool oil_known = false;
    OilEffects oil;
    std::vector<HydraulicOperator> hydraulics;  // per pair
    std::int64_t misses = 0;                    // since construction

  private:
    void place_matrices(const ModelData& model);
    void place_trees(const ModelData& model);
};

// The mode of these contact states, from the table or built now. Those in scratch.trial are tried: their mode may be forgotten when
// the next one is asked for. Any others are in force from now on, and the mode that was so until now may be forgotten.
Mode& find_mode(const ModelData& model, OperatorsData& operators, const unsigned char* contact,
                ScratchData& scratch) SHIFTRIG_REALTIME;

// Step operators and ledger, once somebody is to step in the mode: contact states that are only tried never need them.
void make_ready(const ModelData& model, Mode& mode, ScratchData& scratch) SHIFTRIG_REALTIME;
inline bool is_ready(const Mode& mode) noexcept {
    return mode.tree || mode.step.length > 0;
}

// The hydraulic operators at this oil temperature.
void at_oil_temperature(const ModelData& model, OperatorsData& operators,
                        double temperature) SHIFTRIG_REALTIME;

}  // namespace shiftrig::plant::detail
