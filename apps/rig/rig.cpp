#include "apps/rig/rig.h"

#include <algorithm>
#include <stdexcept>

namespace shiftrig::rig {

namespace {

plant::Model build(const Setup& setup) {
    plant::BuildOptions options;
    options.step_size = static_cast<double>(setup.tick_ns) * 1e-9 / setup.substeps;
    options.kernel = setup.kernel;
    if (setup.scenario) options.seed = static_cast<std::uint64_t>(setup.scenario->seed);
    return io::build_model(setup.model, options);
}

// What the scenario chooses before anything is built: gear options, and the seed of what is drawn at random.
Setup with_options(Setup setup) {
    if (!setup.scenario) return setup;
    const auto& start = setup.scenario->start;
    try {
        for (const auto& [gear, option] : start.options)
            io::select_option(setup.model.description, gear, option);
    } catch (const std::invalid_argument& error) {
        throw io::InputError(setup.scenario->path, start.options_place.line, start.options_place.column,
                             error.what());
    }
    setup.buses.seed = static_cast<std::uint64_t>(setup.scenario->seed);
    return setup;
}

io::SignalTable table_of(const plant::Model& model, RigSignals& own) {
    io::SignalTable signals;
    for (const auto& signal : model.inputs()) signals.add(signal);
    for (const auto& signal : model.outputs()) signals.add(signal);
    const auto add = [&](const char* name, double minimum, double maximum, const char* text) {
        return signals.add({name, plant::Unit::one, 0, minimum, maximum, text});
    };
    own.lever = add("driver.lever", -9, 99, "wanted gear: -1 reverse, 0 neutral, 1… forward");
    own.clutch_pedal = add("driver.clutch_pedal", 0, 1, "0 released … 1 fully pressed");
    own.parking_brake = add("driver.parking_brake", 0, 1, "1: applied");
    own.automatic = add("driver.auto", 0, 1, "1: the lever is an upper bound, the controller chooses");
    own.safe_command = add("rig.safe_command", 0, 1, "1 while the safe command acts");
    own.overruns = add("rig.overruns", 0, 1e300, "ticks that ended too late, since start");
    own.tick_load = add("rig.tick_load", 0, 1e300, "compute time of the last tick over the period");
    own.limited_inputs = add("rig.limited_inputs", 0, 1e300, "inputs limited to their range, since start");
    return signals;
}

std::array<int, 4> driver_signals(const RigSignals& own) SHIFTRIG_REALTIME {
    return {own.lever, own.clutch_pedal, own.parking_brake, own.automatic};
}

// Inputs, and what belongs to the driver.
std::vector<bool> settable(const plant::Model& model, const io::SignalTable& signals) {
    std::vector<bool> result(static_cast<std::size_t>(signals.size()), false);
    for (int i = 0; i < signals.size(); ++i)
        result[static_cast<std::size_t>(i)] =
            i < static_cast<int>(model.inputs().size()) || signals.signal(i).name.starts_with("driver.");
    return result;
}

}  // namespace

Rig::Rig(Setup setup)
    : setup_(with_options(std::move(setup))),
      model_(build(setup_)),
      operators_(model_),
      state_(model_),
      inputs_(model_),
      outputs_(model_),
      scratch_(model_),
      signals_(table_of(model_, own_)),
      settable_(settable(model_, signals_)),
      buses_(setup_.buses, setup_.model, setup_.tick_ns, signals_),
      safe_commands_(setup_.model, model_) {
    settable_.resize(static_cast<std::size_t>(signals_.size()), false);  // what the buses added is not
    const auto add_range = [this](const plant::Signal& s) { ranges_.emplace_back(s.minimum, s.maximum); };
    for (const auto& input : model_.inputs()) add_range(input);
    for (const int signal : driver_signals(own_)) add_range(signals_.signal(signal));
    const auto& side = setup_.model.controller;
    if (!side.pedal_clutch.empty())
        pedal_release_ = model_.input("clutch." + side.pedal_clutch + ".release_command");
    service_brake_ = model_.input("driver.brake");
    for (int i = 0; i < signals_.size(); ++i) {
        const auto& name = signals_.signal(i).name;
        if (name.starts_with("bus.") && name.ends_with(".status")) statuses_.push_back(i);
    }
    last_status_.resize(statuses_.size(), 0);
    begin();
}

Rig::~Rig() = default;

// The start the scenario describes: inputs, gears locked, speeds, and a while to settle without the controller.
void Rig::begin() {
    if (!setup_.scenario) {
        copy_inputs();
    } else {
        const auto& scenario = *setup_.scenario;
        io::check_signals(scenario, signals_);
        check_whole_numbers(scenario);
        io::check_events(scenario, model_);
        timeline_ = Timeline(scenario, signals_, settable_);
        for (const auto& setting : scenario.start.inputs)
            signals_.value[static_cast<std::size_t>(
                find_settable(signals_, settable_, scenario.path, setting.quantity))] = setting.value;
        copy_inputs();
        if (setup_.resumes) return;
        plant::Start start;
        start.locked = scenario.start.locked;
        for (const auto& speed : scenario.start.speeds)
            start.speeds.emplace_back(speed.quantity.signal, speed.value);
        if (!start.locked.empty() || !start.speeds.empty()) start_plant(start, scenario);
        settle(scenario.start.settle);
    }
    plant::observe(model_, operators_, state_, inputs_, outputs_, scratch_);
    publish();
}

void Rig::start_plant(const plant::Start& start, const io::ScenarioFile& scenario) {
    try {
        plant::start(model_, state_, start, inputs_);
    } catch (const plant::ModelError& error) {
        io::KeyPlace place = scenario.start.locked_place;
        for (const auto& speed : scenario.start.speeds)
            if (error.field == "speeds" && speed.quantity.signal == error.device)
                place = {speed.quantity.line, speed.quantity.column};
        throw io::InputError(scenario.path, place.line, place.column, error.what());
    }
}

void Rig::settle(double seconds) {
    const auto steps = std::llround(seconds / model_.step_size());
    for (long long i = 0; i < steps; ++i)
        plant::step(model_, operators_, state_, inputs_, outputs_, scratch_);
    plant::begin_account(model_, state_);
}

void Rig::tick() SHIFTRIG_REALTIME {
    const std::int64_t now = sim_time_ns();
    rig_event_count_ = 0;
    rig_events_not_kept_ = 0;
    buses_.receive(now, signals_);
    timeline_.apply(now, signals_);
    for (const auto& entry : timeline_.begun()) note(RigEventKind::input_set, entry.signal, entry.value);
    take_requests();
    copy_inputs();
    watch_the_controller(now);
    step_plant();
    ++ticks_;
    publish();
    buses_.send(sim_time_ns(), signals_);
}

// The table holds what scenario, driver and controller want; the plant gets what is possible.
void Rig::copy_inputs() SHIFTRIG_REALTIME {
    const std::size_t inputs = inputs_.value.size();
    for (std::size_t i = 0; i < inputs; ++i)
        inputs_.value[i] = limited(static_cast<int>(i), ranges_[i], inputs_.value[i]);
    const auto driver = driver_signals(own_);
    for (std::size_t i = 0; i < driver.size(); ++i)
        driver_[i] = limited(driver[i], ranges_[inputs + i], driver_[i]);
    const auto value = [&](int signal) { return signals_.value[static_cast<std::size_t>(signal)]; };
    if (pedal_release_ >= 0) {
        double& release = inputs_.value[static_cast<std::size_t>(pedal_release_)];
        release = std::max(release, value(own_.clutch_pedal));
    }
    if (service_brake_ >= 0 && value(own_.parking_brake) > 0.5)
        inputs_.value[static_cast<std::size_t>(service_brake_)] = 1;
}

// What is wanted of a signal, within its range; `last` where it is not a number. Said once: from then on it is wanted so.
double Rig::limited(int signal, const std::pair<double, double>& range, double last) SHIFTRIG_REALTIME {
    double& wanted = signals_.value[static_cast<std::size_t>(signal)];
    const double given = std::clamp(wanted, range.first, range.second);
    if (given == wanted) return wanted;
    note(RigEventKind::input_limited, signal, wanted);
    signals_.value[static_cast<std::size_t>(own_.limited_inputs)] += 1;
    return wanted = std::isnan(wanted) ? last : given;
}

void Rig::watch_the_controller(std::int64_t now_ns) SHIFTRIG_REALTIME {
    const bool was_active = safe_commands_.active();
    safe_commands_.apply(buses_.command_valid(), now_ns, inputs_.value);
    const bool active = safe_commands_.active();
    signals_.value[static_cast<std::size_t>(own_.safe_command)] = active ? 1 : 0;
    if (active != was_active)
        note(active ? RigEventKind::safe_command : RigEventKind::commands_return, own_.safe_command, active);
    for (std::size_t i = 0; i < statuses_.size(); ++i) {
        const double status = signals_.value[static_cast<std::size_t>(statuses_[i])];
        if (status != last_status_[i]) note(RigEventKind::message_status, statuses_[i], status);
        last_status_[i] = status;
    }
}

void Rig::step_plant() SHIFTRIG_REALTIME {
    certificate_ = {};
    event_count_ = 0;
    events_not_kept_ = 0;
    for (int i = 0; i < setup_.substeps; ++i) {
        plant::step(model_, operators_, state_, inputs_, outputs_, scratch_);
        add(certificate_, outputs_.certificate);
        const auto kept =
            static_cast<std::size_t>(std::min(outputs_.event_count, plant::Outputs::event_capacity));
        const std::size_t fit = std::min(kept, events_.size() - event_count_);
        std::copy_n(outputs_.events.begin(), fit,
                    events_.begin() + static_cast<std::ptrdiff_t>(event_count_));
        event_count_ += fit;
        // Where there are more than fit the last one is no change, but says so.
        const bool all = outputs_.event_count <= plant::Outputs::event_capacity;
        events_not_kept_ += outputs_.event_count - static_cast<int>(fit) + (all ? 0 : 1);
    }
    if (setup_.substeps == 1) return;
    outputs_.certificate = certificate_;
    plant::show_certificate(outputs_);
}

void Rig::publish() SHIFTRIG_REALTIME {
    std::copy(outputs_.value.begin(), outputs_.value.end(),
              signals_.value.begin() + static_cast<std::ptrdiff_t>(inputs_.value.size()));
}

void Rig::take_requests() SHIFTRIG_REALTIME {
    Request request{};
    while (requests_.pop(request)) {
        signals_.value[static_cast<std::size_t>(request.signal)] = request.value;
        note(RigEventKind::input_requested, request.signal, request.value);
    }
}

plant::Model Rig::build_changed(Setup& changed, io::ModelFile file) const {
    changed = setup_;
    io::replace(changed.model, std::move(file));
    changed = with_options(std::move(changed));
    plant::Model model = build(changed);
    if (model.state_size() != model_.state_size())
        throw std::invalid_argument(
            "this changes what the machine's state is made of: start the rig anew with it");
    return model;
}

void Rig::check_machine(io::ModelFile file) const {
    Setup changed;
    (void)build_changed(changed, std::move(file));
}

void Rig::change_machine(io::ModelFile file) {
    Setup changed;
    model_ = build_changed(changed, std::move(file));
    io::replace(setup_.model, std::move(changed.model));
    operators_ = plant::Operators(model_);
    scratch_ = plant::Scratch(model_);
}

bool Rig::request(int signal, double value) SHIFTRIG_REALTIME {
    if (signal < 0 || signal >= signals_.size() || !settable_[static_cast<std::size_t>(signal)]) return false;
    return requests_.push({signal, value});
}

void Rig::report_timing(std::int64_t overruns, double load) SHIFTRIG_REALTIME {
    signals_.value[static_cast<std::size_t>(own_.overruns)] = static_cast<double>(overruns);
    signals_.value[static_cast<std::size_t>(own_.tick_load)] = load;
}

void Rig::note(RigEventKind kind, int signal, double value) SHIFTRIG_REALTIME {
    if (rig_event_count_ < rig_events_.size())
        rig_events_[rig_event_count_++] = {sim_time(), kind, signal, value};
    else
        ++rig_events_not_kept_;
}

bool Rig::wait_for_answer(std::int64_t timeout_ns) {
    return buses_.wait_for_answer(sim_time_ns(), signals_, timeout_ns);
}

std::span<const double> Rig::rig_values() const SHIFTRIG_REALTIME {
    return std::span(signals_.value).subspan(inputs_.value.size() + outputs_.value.size());
}

std::vector<plant::Signal> Rig::rig_signals() const {
    std::vector<plant::Signal> result;
    for (int i = static_cast<int>(inputs_.value.size() + outputs_.value.size()); i < signals_.size(); ++i)
        result.push_back(signals_.signal(i));
    return result;
}

void Rig::archive(io::Archive& a) {
    a(ticks_, state_.block, inputs_.value, outputs_.value, signals_.value, driver_, last_status_);
    timeline_.archive(a);
    safe_commands_.archive(a);
    buses_.archive(a);
}

}  // namespace shiftrig::rig
