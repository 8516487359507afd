// Builds a Model: indices, laws with their constants, and the names of all signals.
#include <algorithm>
#include <cmath>

#include "plant/connectors.h"
#include "plant/ledger.h"
#include "plant/model_builder.h"
#include "plant/model_decisions.h"
#include "plant/modes.h"

namespace shiftrig::plant {
namespace detail {
namespace {

// The housing as a mass of factor 0.
template <std::size_t count>
std::array<Link, count> branchless(std::array<Link, count> links) {
    for (Link& link : links) {
        if (link.mass < 0) link = {0, 0};
    }
    return links;
}

// Where a torque on this mass stands in f.
int external_force(ModelData& m, int mass) {
    int& index = m.external_force[static_cast<std::size_t>(mass)];
    if (index >= 0) return index;
    index = static_cast<int>(m.force_columns.size());
    m.force_columns.push_back({Link{mass, -1}, Link{}});  // into the mass
    return index;
}

}  // namespace

int ModelBuilder::input(const std::string& name, Unit unit, double initial, double minimum, double maximum,
                        const std::string& description) {
    const auto [at, fresh] = model.input_index.emplace(name, static_cast<int>(model.inputs.size()));
    if (fresh) model.inputs.push_back({name, unit, initial, minimum, maximum, description});
    return at->second;
}

int ModelBuilder::flag(const std::string& name, const std::string& description) {
    return input(name, Unit::one, 0, 0, 1, description);
}

void ModelBuilder::output(const std::string& name, Unit unit, const std::string& description) {
    model.output_index.emplace(name, static_cast<int>(model.outputs.size()));
    model.outputs.push_back({name, unit, 0, -1e300, 1e300, description});
}

int ModelBuilder::external(int mass) {
    return external_force(model, mass);
}

void ModelBuilder::breakpoints(const Waveform& waveform) {
    for (const Waveform::Piece& piece : waveform.pieces) {
        if (piece.from > -1e299) model.breakpoints.push_back(piece.from);
        if (piece.until < 1e299) model.breakpoints.push_back(piece.until);
    }
}

namespace {

// Counts, links and columns that follow from the structure alone.
void build_columns(ModelData& m) {
    const Structure& s = m.structure;
    m.masses = s.masses();
    m.twists = static_cast<int>(s.shafts.size());
    m.pairs = static_cast<int>(s.pairs.size());
    m.meshes = static_cast<int>(s.meshes.size());
    m.states = m.masses + m.twists;
    m.states_padded = padded(m.states);
    m.torques = m.pairs + 2 * m.meshes;
    m.first_flank = m.pairs + m.meshes;
    m.plain_shafts = static_cast<int>(
        std::count_if(s.shafts.begin(), s.shafts.end(), [](const Elastic& shaft) { return shaft.gap == 0; }));
    m.contact_bytes = m.first_flank + m.twists - m.plain_shafts;
    for (double inertia : s.inertia) m.root_inertia.push_back(std::sqrt(inertia));
    for (const FrictionPair& pair : s.pairs) {
        const double noteworthy = 1e-2 * pair.nominal_capacity;
        if (pair.kind != PairKind::clutch || (m.noteworthy_torque > 0 && noteworthy > m.noteworthy_torque))
            continue;
        m.noteworthy_torque = noteworthy;
    }
    for (double inertia : s.inertia) m.energy_factor.push_back(0.5 * inertia);
    for (const Elastic& shaft : s.shafts)
        m.energy_factor.push_back(shaft.gap > 0 ? 0 : 0.5 * shaft.stiffness);
    for (int j = 0; j < m.masses; ++j) {
        if (m.description.masses[static_cast<std::size_t>(j)].motion == Motion::translating)
            m.translating.push_back(j);
    }

    for (const FrictionPair& pair : s.pairs) m.pair_slip.push_back(branchless(pair.links));
    for (const Mesh& mesh : s.meshes) m.mesh_motion.push_back(branchless(mesh.motion()));
    for (const Mesh& mesh : s.meshes) {
        const auto k = static_cast<int>(m.lossy.size());
        if (mesh.lossy()) {
            m.lossy_meshes.push_back(k);
        } else if (m.lossy.size() < m.description.gears.size()) {  // they are the first meshes
            m.lossless_gears.push_back(k);
        }
        m.lossy.push_back(mesh.lossy());
        m.loss_kink.push_back(mesh.loss_kink());
    }
    for (const Mesh& mesh : s.meshes) m.mesh_slip.push_back(branchless(mesh.column(mesh.ratio)));
    for (const Mesh& mesh : s.meshes) m.mesh_loss.push_back(branchless(mesh.loss()));
    for (const Elastic& shaft : s.shafts) m.shaft_rate.push_back(branchless(shaft.links));
    for (const Elastic& damper : s.dampers) m.damper_rate.push_back(branchless(damper.links));

    for (const FrictionPair& pair : s.pairs) m.force_columns.push_back(pair.links);
    for (const Mesh& mesh : s.meshes) {
        const bool bearing = mesh.forward_bearing > 0 || mesh.backward_bearing > 0;
        m.bearing_force.push_back(bearing ? static_cast<int>(m.force_columns.size()) : -1);
        if (bearing) m.force_columns.push_back(mesh.loss());
    }
    m.first_external = static_cast<int>(m.force_columns.size());
    m.external_force.assign(static_cast<std::size_t>(m.masses), -1);
}

void build_pair_laws(ModelBuilder& builder) {
    ModelData& m = builder.model;
    for (const FrictionPair& pair : m.structure.pairs) {
        PairLaw& law = m.pair_laws.emplace_back();
        if (pair.kind != PairKind::clutch) law.friction.base = law.friction.static_factor = 1;
        if (pair.kind == PairKind::body_resistance) law.source = LoadSource::resistance;
    }
    for_each_connector(m.description, [&](const auto& connector) { add_pair_law(builder, connector); });
    for_each_kind(all_kinds(m.description), [&m]<class Kind>(const std::vector<Kind>& devices) {
        m.first_pair[place_of<Kind>] = devices.empty() ? -1 : m.structure.pair(devices.front().name);
    });
    int heated = 0;
    for (int k = 0; k < m.pairs; ++k) {
        PairLaw& law = builder.law(k);
        if (law.heat) law.temperature = heated++;
        law.sliding_at_rest = sliding_factor(law.friction, 0);
        if (law.friction.factor_over_slip != nullptr) m.tabled_pairs.push_back(k);
        if (law.source == LoadSource::waveform) m.depends_on_time = true;
        if (law.hydraulic) m.hydraulic_pairs.push_back(k);
        if (law.source == LoadSource::release || law.source == LoadSource::apply) m.pedal_pairs.push_back(k);
        if (law.source == LoadSource::waveform) m.waveform_pairs.push_back(k);
        if (law.heat) m.heated_pairs.push_back(k);
        if (is_actuated(law.source)) m.actuated_pairs = k + 1;
    }
    m.layout.actuators = builder.actuator(0);  // sizes for now, offsets in build_layout
    m.layout.temperatures = 2 * whole_panels(heated);
}

void build_laws(ModelBuilder& builder) {
    ModelData& m = builder.model;
    const Description& d = m.description;
    build_pair_laws(builder);
    for_each_connector(d, [&](const auto& connector) { add_law(builder, connector); });
    if (d.oil)
        m.oil_temperature = builder.input("environment.oil_temperature", Unit::celsius,
                                          d.oil->initial_temperature, -40, 200, "transmission oil");
    for (const SpeedSensor& sensor : d.sensors) {
        const std::string prefix = "sensor." + sensor.name + ".";
        SensorLaw law;
        law.mass = m.structure.mass(sensor.mass);
        law.bias = builder.input(prefix + "bias", Unit::radian_per_second, 0, -1e6, 1e6,
                                 "fault: added to the reading");
        law.noise =
            builder.input(prefix + "noise", Unit::radian_per_second, 0, 0, 1e6, "fault: standard deviation");
        law.stuck = builder.flag(prefix + "stuck", "fault: 1 holds the reading");
        law.dropout = builder.flag(prefix + "dropout", "fault: 1 reads 0");
        law.missing_teeth = builder.input(prefix + "missing_teeth", Unit::one, 0, 0, 1000,
                                          "fault: teeth without an edge per turn");
        m.sensors.push_back(law);
    }
    std::sort(m.breakpoints.begin(), m.breakpoints.end());
    m.breakpoints.erase(std::unique(m.breakpoints.begin(), m.breakpoints.end()), m.breakpoints.end());
}

// Behind the external forces those of flanks; then what the sizes and laws of all devices give.
void build_sizes(ModelData& m) {
    const Structure& s = m.structure;
    for (int mass : m.translating) m.translating_force.push_back(external_force(m, mass));
    m.first_flank_force = static_cast<int>(m.force_columns.size());
    for (int e = m.plain_shafts; e < m.twists; ++e) {
        const Elastic& shaft = s.shafts[static_cast<std::size_t>(e)];
        m.backlashes.push_back({e, m.first_flank + e - m.plain_shafts,
                                static_cast<int>(m.force_columns.size()), shaft.stiffness, shaft.damping,
                                0.5 * shaft.gap});
        m.force_columns.push_back(shaft.links);
    }
    m.forces = static_cast<int>(m.force_columns.size());
    m.rare_forces = !m.tabled_pairs.empty() || !m.one_way_pairs.empty() || !m.backlashes.empty() ||
                    m.first_external > m.pairs;
    for (const auto& links : m.force_columns) m.force_on.push_back(branchless(links));
    m.columns = m.states + m.forces;
    m.law_rows = whole_panels(m.forces + m.meshes);
    m.power_rows = m.law_rows + whole_panels(m.meshes + m.twists + static_cast<int>(s.dampers.size()));
    m.seen = m.power_rows + m.states;
    for (const auto* elastics : {&s.shafts, &s.dampers}) {
        for (const Elastic& elastic : *elastics)
            m.swing_damping.push_back(elastic.gap > 0 ? 0 : elastic.damping);
    }
    for (const Elastic& shaft : s.shafts) m.shaft_stiffness.push_back(shaft.stiffness);
    if (m.description.oil) m.drag_speed_limit = m.description.oil->drag_speed_limit;
    for (const PairLaw& law : m.pair_laws) {
        m.static_factor.push_back(law.friction.static_factor);
        m.sliding_at_rest.push_back(law.sliding_at_rest);
    }
    for (int k = 0; k < m.forces; ++k) {
        m.power_lost.push_back(k < m.first_external ? 1 : 0);
        m.power_given.push_back(k >= m.first_external && k < m.first_flank_force ? 1 : 0);
    }
    m.swings = static_cast<int>(m.swing_damping.size());
    m.ledger_levels = most_ledger_levels(s, m.options.step_size);
    for (auto* numbers : {&m.energy_factor, &m.static_factor, &m.sliding_at_rest, &m.shaft_stiffness,
                          &m.swing_damping, &m.power_lost, &m.power_given})
        numbers->resize(numbers->size() + loop_slack, 0.);
}

// In the order in which outputs.cpp writes them.
void build_outputs(ModelBuilder& builder) {
    const ModelData& m = builder.model;
    const Description& d = m.description;
    const auto add = [&](const std::string& name, Unit unit, const char* text) {
        builder.output(name, unit, text);
    };
    const auto name_all = [&](const auto& devices) { name_outputs(builder, devices); };
    for (const Mass& mass : d.masses) {
        add("mass." + mass.name + ".speed",
            mass.motion == Motion::rotating ? Unit::radian_per_second : Unit::metre_per_second, "speed");
    }
    for_each_kind(driveline_kinds(d), name_all);
    for (int j : m.translating) {
        const std::string prefix = "body." + m.structure.mass_names[static_cast<std::size_t>(j)] + ".";
        add(prefix + "acceleration", Unit::metre_per_second2, "acceleration");
        add(prefix + "distance", Unit::metre, "way since start");
    }
    for_each_kind(load_kinds(d), name_all);
    for (const SpeedSensor& sensor : d.sensors)
        add("sensor." + sensor.name + ".speed", Unit::radian_per_second, "reading");
    if (d.oil) {
        add("oil.temperature", Unit::celsius, "oil temperature");
        add("oil.viscosity", Unit::one, "dynamic viscosity in Pa s");
    }
    add("energy.input", Unit::joule, "work of engines, sources, grade and air since start");
    add("energy.stored", Unit::joule, "kinetic and strain energy");
    add("energy.dissipated", Unit::joule, "friction, mesh losses, damping, tyres, converters since start");
    add("energy.defect", Unit::joule, "stored minus start minus input plus dissipated");
    add("certificate.torque_residual", Unit::one, "of the internal torques, relative");
    add("certificate.constraint_violation", Unit::one, "worst speed difference across a rigid device, rad/s");
    add("certificate.energy_defect", Unit::joule, "of this step");
    add("certificate.events", Unit::one, "state changes located inside this step");
    add("certificate.fall_backs", Unit::one, "state changes deferred to the end of this step");
    add("certificate.mode_lookups", Unit::one, "modes asked for");
    add("certificate.mode_misses", Unit::one, "modes built");
    add("certificate.flags", Unit::one,
        "bit 0 tie-up, bit 1 no directions of power agreed, bit 2 not finite, bit 3 coarse, bit 4 instant "
        "not "
        "found");
}

}  // namespace
}  // namespace detail

Model::Model(std::unique_ptr<detail::ModelData> data) : data_(std::move(data)) {}
Model::Model(Model&&) noexcept = default;
Model& Model::operator=(Model&&) noexcept = default;
Model::~Model() = default;

Model Model::build(const Description& description, const BuildOptions& options) {
    auto data = std::make_unique<detail::ModelData>();
    detail::ModelData& m = *data;
    m.description = description;
    m.options = options;
    if (!(options.step_size > 0) || !std::isfinite(options.step_size)) {
        throw ModelError("model", description.name, "step_size",
                         "= " + std::to_string(options.step_size) + "; must be > 0");
    }
    m.kernel = detail::choose_kernel(options.kernel);
    m.structure = build_structure(m.description);
    detail::ModelBuilder builder(m);
    detail::build_columns(m);
    detail::build_laws(builder);
    detail::build_sizes(m);
    detail::bound_step(m);
    detail::choose_engine(m);
    detail::build_device_numbers(m);
    detail::build_layout(m);
    detail::build_outputs(builder);
    for (const FrictionPair& pair : m.structure.pairs) m.device_names.push_back(pair.name);
    for (const Mesh& mesh : m.structure.meshes) m.device_names.push_back(mesh.name);
    for (const Elastic& shaft : m.structure.shafts) {
        if (shaft.gap > 0) m.device_names.push_back(shaft.name);
    }
    for (const std::string& teller : builder.tellers) m.device_names.push_back(teller);
    return Model(std::move(data));
}

double Model::step_size() const noexcept {
    return data_->options.step_size;
}
std::uint64_t Model::seed() const noexcept {
    return data_->options.seed;
}
std::string_view Model::kernel() const noexcept {
    return data_->kernel.name;
}
std::string_view Model::engine() const noexcept {
    return data_->tree ? "ark3" : "etd3";
}
std::string_view Model::engine_reason() const noexcept {
    return data_->engine_reason;
}
const Description& Model::description() const noexcept {
    return data_->description;
}
const std::vector<Signal>& Model::inputs() const noexcept {
    return data_->inputs;
}
const std::vector<Signal>& Model::outputs() const noexcept {
    return data_->outputs;
}
const std::vector<std::string>& Model::device_names() const noexcept {
    return data_->device_names;
}
std::size_t Model::state_size() const noexcept {
    return static_cast<std::size_t>(data_->layout.size) * sizeof(double);
}

int Model::input(std::string_view name) const noexcept {
    const auto at = data_->input_index.find(name);
    return at == data_->input_index.end() ? -1 : at->second;
}
int Model::output(std::string_view name) const noexcept {
    const auto at = data_->output_index.find(name);
    return at == data_->output_index.end() ? -1 : at->second;
}

Inputs::Inputs(const Model& model) {
    for (const Signal& signal : model.inputs()) value.push_back(signal.initial);
}
Outputs::Outputs(const Model& model) : value(model.outputs().size(), 0.) {}

}  // namespace shiftrig::plant
