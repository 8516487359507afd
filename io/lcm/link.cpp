#include "io/lcm/link.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>

#include "io/lcm/channels.h"
#include "io/lcm/names.h"
#include "io/lcm/sequence.h"
#include "shiftrig/clutch_command_t.hpp"
#include "shiftrig/driver_input_t.hpp"
#include "shiftrig/engine_request_t.hpp"
#include "shiftrig/plant_state_t.hpp"
#include "shiftrig/speeds_t.hpp"
#include "shiftrig/transmission_status_t.hpp"

namespace shiftrig::io::lcm {

namespace {

constexpr int messages_per_tick = 64;  // a flood of messages shall not hold up the loop

SHIFTRIG_TRUSTED_BEGIN  // clock_gettime does not enter the kernel
    std::int64_t
    utime() SHIFTRIG_REALTIME {
    timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
}
SHIFTRIG_TRUSTED_END

SHIFTRIG_TRUSTED_BEGIN  // a generated decoder of fixed-size types; its hash was computed when the link was built
    template <class Type>
    void decode(const Message& bytes, Type& message) SHIFTRIG_REALTIME {
    message.decode(bytes.bytes.data(), 0, static_cast<int>(bytes.size));  // size and fingerprint are checked
}
SHIFTRIG_TRUSTED_END

template <class Type>
Subscription subscription(const char* name) {
    return {name, Type::getHash(), static_cast<std::size_t>(Type().getEncodedSize())};
}

double get(const SignalTable& signals, int index) noexcept {
    return index < 0 ? 0.0 : signals.value[static_cast<std::size_t>(index)];
}

void set(SignalTable& signals, int index, double value) noexcept {
    if (index >= 0) signals.value[static_cast<std::size_t>(index)] = value;
}

// A signal that stands for a whole number; what does not fit (never a sound value) becomes the nearest that
// does.
template <class Integer>
Integer whole(double value) noexcept {
    constexpr double most = static_cast<double>(std::numeric_limits<Integer>::max() / 2);
    return std::isnan(value) ? Integer{0} : static_cast<Integer>(std::clamp(value, -most, most));
}

template <class... Numbers>
bool finite(Numbers... numbers) {
    return (std::isfinite(numbers) && ...);
}

// What a received channel is doing; status as in io/can.
struct Channel {
    ChannelReport report;
    Sequence sequence;
    int status = -1;  // index of bus.<message>.status
    std::int64_t last_good_ns = 0;
    bool seen = false;

    bool alive(std::int64_t now_ns, std::int64_t timeout_ns) const noexcept {
        return seen && now_ns - last_good_ns <= timeout_ns;
    }
};

// Whether something is due: at once, then whenever simulated time has passed a multiple of the period (or began anew). The
// grid is that of time itself: both sides know it, and lateness does not move it.
struct Cycle {
    std::int64_t period_ns = 1, last = -1;
    bool due(std::int64_t sim_time_ns) noexcept {
        const std::int64_t now = sim_time_ns / period_ns;
        return std::exchange(last, now) != now;
    }
};

}  // namespace

struct LcmLink::Data {
    LinkOptions options;
    std::unique_ptr<Endpoint> endpoint;
    std::vector<Channel> channels;  // by subscription
    std::vector<std::string> warnings;
    Names names;
    int command_valid_signal = -1, command_age_signal = -1;
    bool command_valid = true;
    std::int64_t first_receive_ns = INT64_MIN;

    Cycle speeds_cycle, state_cycle, info_cycle, status_cycle;
    speeds_t speeds{};
    plant_state_t state{};
    plant_info_t info{};
    driver_input_t driver{}, driver_request{};
    clutch_command_t command{};
    engine_request_t engine{};
    transmission_status_t transmission{};
    std::int64_t answered_seq = -1;  // rig: newest speeds_t.seq that a command has answered
    std::int64_t answered_ns = -1;   // and the simulated time at which that was asked; −1: none yet
    std::int64_t question_seq = -1;  // controller: newest speeds_t.seq seen
    std::int64_t rig_time_ns = 0;
    std::int64_t command_arrived_ns =
        0;  // rig: of the oldest command that no message sent reflects yet; 0: none

    enum Inbound : std::size_t { at_command, at_engine, at_transmission, at_driver };  // rig
    enum Heard : std::size_t { at_speeds, at_driver_input };                           // controller

    template <class Type>
    void stamp(Type& message, std::int64_t now_ns) {
        message.utime = utime();
        message.sim_time_ns = now_ns;
    }
    template <class Type>
    void post(const char* name, Type& message) {
        endpoint->send(name, message, command_arrived_ns);
        command_arrived_ns = 0;
        ++message.seq;
    }

    void listen(SignalTable& signals, const std::string& url, const std::vector<Subscription>& subscriptions,
                const std::vector<const char*>& messages);
    void start_rig(SignalTable& signals, const std::string& url);
    void start_controller(SignalTable& signals, const std::string& url);

    bool plausible(const clutch_command_t& message) const noexcept;
    void take(const Message& message, std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME;
    template <class Type>
    bool believe(const Message& bytes, std::int64_t now_ns, Type& message) noexcept;
    void apply_command(const clutch_command_t& message, SignalTable& signals) noexcept;
    void apply_driver(const driver_input_t& message, SignalTable& signals) const noexcept;
    void apply_speeds(const speeds_t& message, SignalTable& signals) noexcept;
    void update_status(std::int64_t now_ns, SignalTable& signals) noexcept;

    void fill_driver(const SignalTable& signals) noexcept;
    void fill_speeds(const SignalTable& signals) noexcept;
    void fill_state(const SignalTable& signals) noexcept;
    void fill_command(const SignalTable& signals) noexcept;
    void send_rig(std::int64_t now_ns, const SignalTable& signals) noexcept;
    void send_controller(const SignalTable& signals) noexcept;
};

// ---- construction ---------------------------------------------------------------------------------------

LcmLink::LcmLink(const std::string& url, SignalTable& signals, const LinkOptions& options)
    : data_(std::make_unique<Data>()) {
    data_->options = options;
    if (options.role == Role::rig)
        data_->start_rig(signals, url);
    else
        data_->start_controller(signals, url);
}

LcmLink::~LcmLink() = default;
LcmLink::LcmLink(LcmLink&&) noexcept = default;

void LcmLink::Data::listen(SignalTable& signals, const std::string& url,
                           const std::vector<Subscription>& subscriptions,
                           const std::vector<const char*>& messages) {
    endpoint = std::make_unique<Endpoint>(url, subscriptions);
    for (std::size_t i = 0; i < subscriptions.size(); ++i) {
        Channel channel;
        channel.report.channel = subscriptions[i].channel;
        channel.status = find_or_add(signals, std::string("bus.") + messages[i] + ".status");
        channels.push_back(std::move(channel));
    }
}

void LcmLink::Data::start_rig(SignalTable& signals, const std::string& url) {
    names = names_of_rig(signals, warnings);
    listen(signals, url,
           {subscription<clutch_command_t>(channel::clutch_command),
            subscription<engine_request_t>(channel::engine_request),
            subscription<transmission_status_t>(channel::transmission_status),
            subscription<driver_input_t>(channel::driver_request)},
           {"clutch_command", "engine_request", "transmission_status", "driver_request"});
    command_valid_signal = find_or_add(signals, "bus.command_valid");
    command_age_signal = find_or_add(signals, "bus.command_age", plant::Unit::second);
    describe(names, info);
    const std::size_t length = std::min(options.model_name.size(), sizeof info.model_name - 1);
    std::memcpy(info.model_name, options.model_name.data(), length);
    info.tick_ns = options.tick_ns;
    info.lockstep = options.lockstep;
    speeds_cycle.period_ns = std::max(options.speeds_period_ns, options.tick_ns);
    state_cycle.period_ns = options.state_period_ns;
    info_cycle.period_ns = options.info_period_ns;
}

void LcmLink::Data::start_controller(SignalTable& signals, const std::string& url) {
    using Clock = std::chrono::steady_clock;
    {
        Endpoint search(url, {subscription<plant_info_t>(channel::plant_info)});
        const auto until = Clock::now() + std::chrono::nanoseconds(options.find_rig_ns);
        if (!search.wait(std::chrono::nanoseconds(until - Clock::now()).count()))
            throw EndpointError("lcm:" + search.url() + ": no rig speaks here (no " + channel::plant_info +
                                " within " + std::to_string(options.find_rig_ns / 1'000'000'000) +
                                " s); start it first");
        info.decode(search.front()->bytes.data(), 0, static_cast<int>(search.front()->size));
    }
    names = names_of_controller(info, signals);
    listen(signals, url,
           {subscription<speeds_t>(channel::speeds), subscription<driver_input_t>(channel::driver_input)},
           {"speeds", "driver_input"});
    status_cycle.period_ns = options.status_period_ns;
    command.answers_seq = question_seq;
}

// ---- receiving --------------------------------------------------------------------------------------------

void LcmLink::receive(std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME {
    auto& self = *data_;
    if (self.first_receive_ns == INT64_MIN) self.first_receive_ns = now_ns;
    for (int i = 0; i < messages_per_tick; ++i) {
        const Message* message = self.endpoint->front();
        if (!message) break;
        self.take(*message, now_ns, signals);
        self.endpoint->pop();
    }
    self.update_status(now_ns, signals);
}

template <class Type>
bool LcmLink::Data::believe(const Message& bytes, std::int64_t now_ns, Type& message) noexcept {
    Channel& channel = channels[bytes.subscription];
    decode(bytes, message);
    const bool silent = !channel.alive(now_ns, options.command_timeout_ns);
    if (message.seq < 0) {
        ++channel.report.implausible;
        return false;
    }
    if (!channel.sequence.accept(message.seq, silent, channel.report)) return false;
    if constexpr (std::is_same_v<Type, clutch_command_t>) {
        if (!plausible(message)) {
            ++channel.report.implausible;
            return false;
        }
    } else if constexpr (std::is_same_v<Type, engine_request_t>) {
        if (!finite(message.speed_request_rad_s, message.torque_limit)) {
            ++channel.report.implausible;
            return false;
        }
    } else if constexpr (std::is_same_v<Type, driver_input_t>) {
        if (!finite(message.throttle, message.brake, message.clutch_pedal)) {
            ++channel.report.implausible;
            return false;
        }
    }
    channel.seen = true;
    channel.last_good_ns = now_ns;
    ++channel.report.good;
    return true;
}

bool LcmLink::Data::plausible(const clutch_command_t& message) const noexcept {
    if (message.clutch_count < 0 || static_cast<std::size_t>(message.clutch_count) > array_length)
        return false;
    for (std::size_t i = 0; i < static_cast<std::size_t>(message.clutch_count); ++i)
        if (message.enable[i] && !finite(message.pressure_pa[i], message.current_a[i], message.fraction[i]))
            return false;
    return true;
}

void LcmLink::Data::take(const Message& bytes, std::int64_t now_ns, SignalTable& signals) SHIFTRIG_REALTIME {
    if (options.role == Role::controller) {
        if (bytes.subscription == at_speeds) {
            speeds_t message;
            if (believe(bytes, now_ns, message)) {
                apply_speeds(message, signals);
            } else if (message.seq == command.answers_seq) {  // asked again: our answer was lost
                post(channel::clutch_command, command);
            }
        } else {
            driver_input_t message;
            if (believe(bytes, now_ns, message)) apply_driver(message, signals);
        }
        return;
    }
    switch (bytes.subscription) {
        case at_command: {
            clutch_command_t message;
            if (!believe(bytes, now_ns, message)) break;
            apply_command(message, signals);
            if (command_arrived_ns == 0) command_arrived_ns = bytes.arrived_ns;
            break;
        }
        case at_engine: {
            engine_request_t message;
            if (!believe(bytes, now_ns, message)) break;
            set(signals, names.speed_request_enable, message.speed_request_enable != 0);
            set(signals, names.speed_request, message.speed_request_rad_s);
            set(signals, names.torque_limit, message.torque_limit);
            set(signals, names.fuel_cut, message.fuel_cut != 0);
            break;
        }
        case at_transmission: {
            transmission_status_t message;
            if (!believe(bytes, now_ns, message)) break;
            set(signals, names.selected_gear, message.selected_gear);
            set(signals, names.current_gear, message.current_gear);
            set(signals, names.shift_in_process, message.shift_in_process != 0);
            set(signals, names.limp, message.limp != 0);
            break;
        }
        default: {
            driver_input_t message;
            if (believe(bytes, now_ns, message)) driver_request = message;
        }
    }
}

void LcmLink::Data::apply_command(const clutch_command_t& message, SignalTable& signals) noexcept {
    const std::size_t count = std::min(names.clutches.size(), static_cast<std::size_t>(message.clutch_count));
    for (std::size_t i = 0; i < count; ++i) {
        if (!message.enable[i]) continue;
        const ClutchSignals& clutch = names.clutches[i];
        const double* values = clutch.kind == CommandKind::pressure  ? message.pressure_pa
                               : clutch.kind == CommandKind::current ? message.current_a
                                                                     : message.fraction;
        set(signals, clutch.command, values[i]);
    }
    if (message.answers_seq < answered_seq) return;
    answered_seq = message.answers_seq;
    if (answered_seq >= 0) answered_ns = message.sim_time_ns;
}

void LcmLink::Data::apply_driver(const driver_input_t& message, SignalTable& signals) const noexcept {
    set(signals, names.throttle, message.throttle);
    set(signals, names.brake, message.brake);
    set(signals, names.clutch_pedal, message.clutch_pedal);
    set(signals, names.lever, message.lever);
    set(signals, names.automatic, message.automatic != 0);
    set(signals, names.parking_brake, message.parking_brake != 0);
}

void LcmLink::Data::apply_speeds(const speeds_t& message, SignalTable& signals) noexcept {
    const auto count = [](std::int32_t said, std::size_t known) {
        return std::min(static_cast<std::size_t>(std::max(said, 0)), known);
    };
    for (std::size_t i = 0; i < count(message.sensor_count, names.sensors.size()); ++i)
        set(signals, names.sensors[i].index, message.speed[i]);
    for (std::size_t i = 0; i < count(message.clutch_count, names.clutches.size()); ++i)
        set(signals, names.clutches[i].pressure, message.pressure_pa[i]);
    set(signals, names.oil_temperature, message.oil_temperature_c);
    set(signals, names.engine_load, message.engine_load);
    set(signals, names.engine_torque, message.engine_torque_nm);
    question_seq = message.seq;
    rig_time_ns = message.sim_time_ns;
}

void LcmLink::Data::update_status(std::int64_t now_ns, SignalTable& signals) noexcept {
    constexpr double never_seen = 0, is_alive = 1, is_lost = 3;
    for (const auto& channel : channels) {
        const bool alive = channel.alive(now_ns, options.command_timeout_ns);
        set(signals, channel.status, !channel.seen ? never_seen : alive ? is_alive : is_lost);
    }
    if (options.role == Role::controller) return;
    // An outside driver replaces the scenario's as long as he is heard.
    if (channels[at_driver].alive(now_ns, options.command_timeout_ns)) apply_driver(driver_request, signals);
    const bool grace = now_ns - first_receive_ns <= options.command_timeout_ns;
    command_valid = channels[at_command].alive(now_ns, options.command_timeout_ns) ||
                    (grace && !channels[at_command].seen);
    set(signals, command_valid_signal, command_valid);
    set(signals, command_age_signal, answered_ns < 0 ? 0 : 1e-9 * static_cast<double>(now_ns - answered_ns));
}

// ---- sending
// ------------------------------------------------------------------------------------------------

void LcmLink::send(std::int64_t now_ns, const SignalTable& signals) SHIFTRIG_REALTIME {
    if (data_->options.role == Role::rig)
        data_->send_rig(now_ns, signals);
    else
        data_->send_controller(signals);
}

// speeds_t comes last: it is the question, and what a controller needs for its answer is then before it.
void LcmLink::Data::send_rig(std::int64_t now_ns, const SignalTable& signals) noexcept {
    if (info_cycle.due(now_ns)) {
        stamp(info, now_ns);
        post(channel::plant_info, info);
    }
    if (state_cycle.due(now_ns)) {
        fill_driver(signals);
        stamp(driver, now_ns);
        post(channel::driver_input, driver);
        fill_state(signals);
        stamp(state, now_ns);
        state.tick = now_ns / options.tick_ns;
        post(channel::plant_state, state);
    }
    if (speeds_cycle.due(now_ns)) {
        fill_speeds(signals);
        stamp(speeds, now_ns);
        speeds.tick = now_ns / options.tick_ns;
        post(channel::speeds, speeds);
    }
}

void LcmLink::Data::send_controller(const SignalTable& signals) noexcept {
    if (question_seq == command.answers_seq) return;
    if (status_cycle.due(rig_time_ns)) {
        engine.speed_request_enable = get(signals, names.speed_request_enable) != 0;
        engine.speed_request_rad_s = get(signals, names.speed_request);
        engine.torque_limit = names.torque_limit < 0 ? 1 : get(signals, names.torque_limit);
        engine.fuel_cut = get(signals, names.fuel_cut) != 0;
        stamp(engine, rig_time_ns);
        post(channel::engine_request, engine);
        transmission.selected_gear = whole<std::int32_t>(get(signals, names.selected_gear));
        transmission.current_gear = whole<std::int32_t>(get(signals, names.current_gear));
        transmission.shift_in_process = get(signals, names.shift_in_process) != 0;
        transmission.limp = get(signals, names.limp) != 0;
        stamp(transmission, rig_time_ns);
        post(channel::transmission_status, transmission);
    }
    fill_command(signals);
    stamp(command, rig_time_ns);
    command.answers_seq = question_seq;
    post(channel::clutch_command, command);
}

void LcmLink::Data::fill_driver(const SignalTable& signals) noexcept {
    driver.throttle = get(signals, names.throttle);
    driver.brake = get(signals, names.brake);
    driver.clutch_pedal = get(signals, names.clutch_pedal);
    driver.lever = whole<std::int32_t>(get(signals, names.lever));
    driver.automatic = get(signals, names.automatic) != 0;
    driver.parking_brake = get(signals, names.parking_brake) != 0;
}

void LcmLink::Data::fill_speeds(const SignalTable& signals) noexcept {
    speeds.sensor_count = static_cast<std::int32_t>(names.sensors.size());
    for (std::size_t i = 0; i < names.sensors.size(); ++i)
        speeds.speed[i] = get(signals, names.sensors[i].index);
    speeds.clutch_count = static_cast<std::int32_t>(names.clutches.size());
    for (std::size_t i = 0; i < names.clutches.size(); ++i)
        speeds.pressure_pa[i] = get(signals, names.clutches[i].pressure);
    speeds.oil_temperature_c = get(signals, names.oil_temperature);
    speeds.engine_load = get(signals, names.engine_load);
    speeds.engine_torque_nm = get(signals, names.engine_torque);
}

void LcmLink::Data::fill_state(const SignalTable& signals) noexcept {
    for (std::size_t i = 0; i < names.masses.size(); ++i)
        state.mass_speed[i] = get(signals, names.masses[i].index);
    for (std::size_t i = 0; i < names.shafts.size(); ++i)
        state.shaft_torque_nm[i] = get(signals, names.shafts[i].index);
    for (std::size_t i = 0; i < names.clutches.size(); ++i) {
        const ClutchSignals& clutch = names.clutches[i];
        state.clutch_torque_nm[i] = get(signals, clutch.torque);
        state.clutch_slip_rad_s[i] = get(signals, clutch.slip);
        state.clutch_capacity_nm[i] = get(signals, clutch.capacity);
        state.clutch_temperature_c[i] = get(signals, clutch.temperature);
        state.clutch_state[i] = whole<std::int8_t>(get(signals, clutch.state));
    }
    state.acceleration_m_s2 = get(signals, names.acceleration);
    state.distance_m = get(signals, names.distance);
    state.draft_n = get(signals, names.draft);
    state.safe_command = get(signals, names.safe_command) != 0;
    state.overruns = whole<std::int64_t>(get(signals, names.overruns));
    state.tick_load = get(signals, names.tick_load);
}

void LcmLink::Data::fill_command(const SignalTable& signals) noexcept {
    command.clutch_count = static_cast<std::int32_t>(names.clutches.size());
    for (std::size_t i = 0; i < names.clutches.size(); ++i) {
        const ClutchSignals& clutch = names.clutches[i];
        const double value = get(signals, clutch.command);
        command.enable[i] = clutch.kind != CommandKind::none;
        command.pressure_pa[i] = clutch.kind == CommandKind::pressure ? value : 0;
        command.current_a[i] = clutch.kind == CommandKind::current ? value : 0;
        command.fraction[i] = clutch.kind == CommandKind::fraction ? value : 0;
    }
}

// ---- what the others want to know
// ---------------------------------------------------------------------------

bool LcmLink::command_valid() const SHIFTRIG_REALTIME {
    return data_->command_valid;
}

bool LcmLink::awaiting_answer() const SHIFTRIG_REALTIME {
    return data_->answered_seq < data_->speeds.seq - 1;
}

void LcmLink::repeat_question() noexcept {
    auto& self = *data_;
    if (self.speeds.seq == 0) return;
    self.endpoint->send(channel::plant_info, self.info);
    speeds_t question = self.speeds;
    --question.seq;  // post() has counted on
    self.endpoint->send(channel::speeds, question);
}

bool LcmLink::question_pending() const SHIFTRIG_REALTIME {
    return data_->question_seq != data_->command.answers_seq;
}

bool LcmLink::wait(std::int64_t timeout_ns) noexcept {
    constexpr std::int64_t patience_ns = 100'000'000;
    while (timeout_ns > patience_ns) {
        if (data_->endpoint->wait(patience_ns)) return true;
        timeout_ns -= patience_ns;
        if (data_->options.lockstep && awaiting_answer()) repeat_question();
    }
    return data_->endpoint->wait(timeout_ns);
}

bool LcmLink::next_command_latency(std::int64_t& latency_ns) SHIFTRIG_REALTIME {
    return data_->endpoint->next_command_latency(latency_ns);
}

std::int64_t LcmLink::rig_time_ns() const SHIFTRIG_REALTIME {
    return data_->rig_time_ns;
}

std::uint64_t LcmLink::messages_lost() const SHIFTRIG_REALTIME {
    const EndpointCounters counters = data_->endpoint->counters();
    std::uint64_t lost = counters.send_failed + counters.send_dropped + counters.receive_dropped;
    for (const auto& channel : data_->channels) lost += channel.report.lost;
    return lost;
}

std::vector<ChannelReport> LcmLink::report() const {
    std::vector<ChannelReport> reports;
    for (const auto& channel : data_->channels) reports.push_back(channel.report);
    return reports;
}

EndpointCounters LcmLink::counters() const SHIFTRIG_REALTIME {
    return data_->endpoint->counters();
}

const std::vector<std::string>& LcmLink::warnings() const noexcept {
    return data_->warnings;
}

}  // namespace shiftrig::io::lcm
