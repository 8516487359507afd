#include "apps/serve/dashboard.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "analysis/report/shift_page.h"
#include "apps/rig/timeline.h"
#include "apps/rig/variation.h"
#include "apps/serve/machine_page.h"
#include "io/signals.h"

namespace shiftrig::serve {

using nlohmann::json;

namespace {

constexpr auto feed_interval = std::chrono::milliseconds(40);
constexpr double kept_seconds = 60;  // for the scorecard of the last shift

// What a number in a command is, or why it is none.
std::string number_in(const json& body, const char* key, double& value) {
    if (!body.contains(key) || !body[key].is_number()) return std::string("\"") + key + "\" must be a number";
    value = body[key].get<double>();
    return std::isfinite(value) ? "" : std::string("\"") + key + "\" must be finite";
}

io::ModelFile with_parameter(const io::ModelFile& present, const std::string& name, double value) {
    rig::YamlVariant variant(present.text, present.path);
    variant.set(name, value, false);
    return io::parse_model(variant.text(), present.path);
}

}  // namespace

Dashboard::Dashboard(rig::Rig& rig, DashboardOptions options) : rig_(rig), options_(std::move(options)) {
    const auto& table = rig.signals();
    for (const auto& name : analysis::scorecard_signals(rig.model().description())) {
        const int index = table.find(name);
        if (index >= 0 && judged_.size() < most_judged) judged_.push_back(index);
    }
    for (const int index : judged_) recent_.columns.push_back({table.signal(index), {}});
    limp_ = table.find("controller.limp");
    recent_.machine = rig.model().description();
    factor_ = options_.loop.factor;
    to_record_ = options_.record_at_once;
    http_ = std::make_unique<HttpServer>(
        options_.http, feed_,
        Handlers{[this] { return model_json(); },
                 [this](std::string_view verb, const std::string& body) { return command(verb, body); },
                 [this] { return recording(); }});
    // After the port is ours: who has it may be writing this very file.
    try {
        const std::lock_guard lock(mutex_);
        if (to_record_) recording_ = std::make_unique<io::RecordingWriter>(next_recording());
    } catch (...) {
        http_.reset();  // its threads look at what would be gone before them
        throw;
    }
    feeder_ = std::thread([this] { feed(); });
}

Dashboard::~Dashboard() {
    ending_ = true;
    feeder_.join();
    http_.reset();
}

// ---- main thread ----------------------------------------------------------------------------------------

rt::LoopReport Dashboard::run() {
    const std::int64_t slots = options_.loop.slots;
    rt::LoopReport report = run_stretch(slots);
    // A stretch ends early for stop(), for what waits, or because the loop gave up: only what waits goes on.
    while (report.outcome == rt::Outcome::stopped && !stopping_)
        report.add(run_stretch(slots - report.executed - report.skipped));
    return report;
}

rt::LoopReport Dashboard::run_stretch(std::int64_t slots) {
    std::optional<rig::Session> session;
    {
        const std::lock_guard lock(mutex_);
        for (auto& what : waiting_) what();
        waiting_.clear();
        rig::SessionOptions options;
        options.loop = options_.loop;
        options.loop.slots = slots;
        options.after = [this](rig::Rig& each, const rt::Tick&) { take(each); };
        if (to_record_ && !recording_) begin_recording();
        options.recording = recording_.get();
        try {
            session.emplace(rig_, options);
        } catch (const io::RecordingError&) {  // its beginning does not fit the disk any more
            end_recording();
            options.recording = nullptr;
            session.emplace(rig_, options);
        }
        if (paused_) session->control().pause();
        session->control().set_factor(factor_);
        if (stopping_) session->control().stop();
        control_ = &session->control();
    }
    const rt::LoopReport report = session->run();
    const std::lock_guard lock(mutex_);
    control_ = nullptr;
    if (!session->certificate().is_finite()) sound_ = false;
    end_recording();
    return report;
}

void Dashboard::stop() {
    stopping_ = true;
    const std::lock_guard lock(mutex_);
    if (control_) control_->stop();
}

void Dashboard::between_stretches(std::function<void()> what) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(what));
    if (control_) control_->stop();
}

// Each recording is a file of its own: shiftrig.lcmlog, shiftrig-2.lcmlog, …
const std::string& Dashboard::next_recording() {
    const std::filesystem::path path(options_.record_path);
    recorded_to_ = options_.record_path;
    if (recordings_++ > 0)
        recorded_to_ = path.parent_path() /
                       (path.stem().string() + "-" + std::to_string(recordings_) + path.extension().string());
    return recorded_to_;
}

void Dashboard::begin_recording() {
    try {
        recording_ = std::make_unique<io::RecordingWriter>(next_recording());
        tell("t=" + std::to_string(rig_.sim_time()) + " recording to " + recorded_to_);
    } catch (const io::RecordingError& error) {
        sound_ = false;
        tell_trouble(error.what());
    }
}

void Dashboard::end_recording() {
    if (!recording_) return;
    const io::RecordingSummary summary = recording_->end();
    recording_.reset();
    if (!summary.error.empty()) tell_trouble(summary.error);
    if (summary.lost > 0)
        tell_trouble(recorded_to_ + ": " + std::to_string(summary.lost) +
                     " ticks were not kept: the disk did not keep up");
    if (!summary.error.empty() || summary.lost > 0) sound_ = false;
}

void Dashboard::set_parameter(const std::string& name, double value) {
    try {
        rig_.change_machine(with_parameter(rig_.setup().model, name, value));
    } catch (const std::exception& error) {
        return tell(error.what());
    }
    char number[32];
    std::snprintf(number, sizeof number, "%.6g", value);
    tell("t=" + std::to_string(rig_.sim_time()) + " " + name + " is set to " + number);
}

void Dashboard::tell(const std::string& text) {
    feed_.change("change", json{{"text", text}}.dump(-1, ' ', false, json::error_handler_t::replace));
}

void Dashboard::tell_trouble(const std::string& text) {
    tell(text);
    std::cerr << io::one_line(text) << '\n';
}

// ---- in the loop ----------------------------------------------------------------------------------------

void Dashboard::take(const rig::Rig& rig) SHIFTRIG_REALTIME {
    const double time = rig.sim_time();
    Row row;
    row.time = time;
    for (std::size_t i = 0; i < judged_.size(); ++i) row.value[i] = rig.value(judged_[i]);
    rows_.push(row);
    for (const auto& event : rig.plant_events()) happenings_.push({false, event, {}});
    for (const auto& event : rig.rig_events()) happenings_.push({true, {}, event});

    filling_.time = time;
    filling_.ticks = rig.ticks();
    filling_.overruns = static_cast<std::int64_t>(rig.value(rig.own().overruns));
    const tcu::Node* built_in = rig.buses().built_in();
    filling_.limp =
        built_in ? built_in->controller().mode() == tcu::Mode::limp : limp_ >= 0 && rig.value(limp_) != 0;
    filling_.count = static_cast<std::uint32_t>(
        std::min<std::size_t>(most_signals, static_cast<std::size_t>(rig.signals().size())));
    for (std::uint32_t i = 0; i < filling_.count; ++i) filling_.value[i] = rig.value(static_cast<int>(i));
    frames_.write(filling_);
}

// ---- feeding thread -------------------------------------------------------------------------------------

void Dashboard::feed() {
    auto next = std::chrono::steady_clock::now();
    int round = 0;
    while (!ending_) {
        const Frame& frame = frames_.read();
        if (frame.count > 0) feed_.sample(sample_json(frame));
        tell_events();
        Row row;
        while (rows_.pop(row)) {
            recent_.time.push_back(row.time);
            for (std::size_t i = 0; i < judged_.size(); ++i) recent_.columns[i].value.push_back(row.value[i]);
        }
        if (++round % 25 == 0) judge_shifts();
        next += feed_interval;
        std::this_thread::sleep_until(next);
    }
}

std::string Dashboard::sample_json(const Frame& frame) const {
    std::string text = "{\"t\":" + std::to_string(frame.time) + ",\"v\":[";
    char number[32];
    for (std::uint32_t i = 0; i < frame.count; ++i) {
        const double v = frame.value[i];
        std::snprintf(number, sizeof number, i ? ",%.7g" : "%.7g", v);
        text += std::isfinite(v) ? number : (i ? ",null" : "null");
    }
    json rest;
    {
        const std::lock_guard lock(mutex_);
        rest["health"] =
            "tick " + std::to_string(frame.ticks) + ", overruns " + std::to_string(frame.overruns) +
            ", load " +
            std::to_string(
                static_cast<int>(100 * frame.value[static_cast<std::size_t>(rig_.own().tick_load)])) +
            " %" + (paused_ ? ", paused" : "") + (recording_ ? ", recording to " + recorded_to_ : "");
    }
    if (frame.value[static_cast<std::size_t>(rig_.own().safe_command)] > 0)
        rest["banner"] = "The controller is silent: the safe command acts.";
    else if (frame.limp)
        rest["banner"] = "The controller is in its limp state.";
    text += "],\"health\":" + rest["health"].dump();
    if (rest.contains("banner")) text += ",\"banner\":" + rest["banner"].dump();
    return text + "}";
}

void Dashboard::tell_events() {
    Happening happening;
    while (happenings_.pop(happening)) {
        const std::lock_guard lock(mutex_);  // the machine may be changed between two stretches
        const std::string text = happening.of_the_rig ? rig::explain(rig_.signals(), happening.own)
                                                      : plant::explain(rig_.model(), happening.plant);
        tell(text);
    }
}

// The last shift whose judgement is settled and that has not been told yet.
void Dashboard::judge_shifts() {
    if (recent_.time.size() < 100) return;
    const auto limits = analysis::default_limits();
    const auto card = analysis::score(recent_, limits);
    for (const auto& score : card.shifts) {
        const double settled = recent_.time[score.shift.settled];
        const bool over = score.shift.end != analysis::ShiftEnd::run_ended && settled < recent_.time.back();
        if (!over || score.shift.ended_at <= told_until_) continue;
        told_until_ = score.shift.ended_at;
        feed_.change("shift", analysis::shift_page(recent_, score, limits).dump());
    }
    if (recent_.time.back() - recent_.time.front() < kept_seconds) return;
    const auto from =
        std::lower_bound(recent_.time.begin(), recent_.time.end(), recent_.time.back() - kept_seconds / 2);
    const auto rows = from - recent_.time.begin();
    recent_.time.erase(recent_.time.begin(), from);
    for (auto& column : recent_.columns)
        column.value.erase(column.value.begin(), column.value.begin() + rows);
}

// ---- HTTP threads ---------------------------------------------------------------------------------------

std::string Dashboard::model_json() const {
    const std::lock_guard lock(mutex_);
    return machine_page(rig_).dump();
}

// Why a parameter cannot have this value; asked before the run is interrupted for it.
std::string Dashboard::refusal(const std::string& name, double value) const {
    const std::lock_guard lock(mutex_);
    const auto all = parameters_of(rig_.model().description());
    if (std::none_of(all.begin(), all.end(), [&](const Parameter& p) { return p.name == name; }))
        return "there is no parameter \"" + name + "\"";
    try {
        rig_.check_machine(with_parameter(rig_.setup().model, name, value));
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

std::string Dashboard::command(std::string_view verb, const std::string& text) {
    const json body = json::parse(text, nullptr, false);
    if (!body.is_object()) return "a command is a JSON object";
    double value = 0;
    if (verb == "input") {
        if (!body.contains("signal") || !body["signal"].is_string()) return "\"signal\" must be a name";
        if (auto wrong = number_in(body, "value", value); !wrong.empty()) return wrong;
        const std::string name = body["signal"].get<std::string>();
        const std::lock_guard lock(mutex_);
        const int index = rig_.signals().find(name);
        if (index >= 0) {
            const std::string wanted = name + " = " + io::in_digits(value) + "; ";
            const io::Rule rule = io::rule_of(rig_.signals().signal(index));
            if (!rule.holds(value)) return wanted + rule.words();
            if (rig::takes_whole_numbers(name) && value != std::floor(value))
                return wanted + "must be a whole number";
        }
        if (!rig_.request(index, value)) return "signal \"" + name + "\" cannot be set";
        return "";
    }
    if (verb == "fault") {
        if (!body.contains("name") || !body["name"].is_string()) return "\"name\" must be a fault";
        if (!body.contains("active") || !body["active"].is_boolean())
            return "\"active\" must be true or false";
        const std::lock_guard lock(mutex_);
        for (const auto& fault : faults_of(rig_))
            if (fault.name == body["name"].get<std::string>())
                return rig_.request(fault.signal, body["active"].get<bool>() ? fault.active : fault.healthy)
                           ? ""
                           : "the rig is busy, try again";
        return "there is no such fault";
    }
    if (verb == "pause") {
        if (!body.contains("paused") || !body["paused"].is_boolean())
            return "\"paused\" must be true or false";
        const std::lock_guard lock(mutex_);
        paused_ = body["paused"].get<bool>();
        if (control_) paused_ ? control_->pause() : control_->resume();
        return "";
    }
    if (verb == "step") {
        const std::lock_guard lock(mutex_);
        if (!paused_) return "pause first";
        if (control_) control_->single_step();
        return "";
    }
    if (verb == "speed") {
        if (auto wrong = number_in(body, "factor", value); !wrong.empty()) return wrong;
        if (!(value >= 0.001 && value <= 10)) return "\"factor\" must be from 0.001 to 10";
        const std::lock_guard lock(mutex_);
        factor_ = value;
        if (control_) control_->set_factor(value);
        return "";
    }
    if (verb == "record") {
        if (!body.contains("active") || !body["active"].is_boolean())
            return "\"active\" must be true or false";
        const bool active = body["active"].get<bool>();
        between_stretches([this, active] { to_record_ = active; });
        return "";
    }
    if (verb == "parameter") {
        if (!body.contains("name") || !body["name"].is_string()) return "\"name\" must be a parameter";
        if (auto wrong = number_in(body, "value", value); !wrong.empty()) return wrong;
        const std::string name = body["name"].get<std::string>();
        if (auto wrong = refusal(name, value); !wrong.empty()) return wrong;
        between_stretches([this, name, value] { set_parameter(name, value); });
        return "";
    }
    return "there is no command \"" + std::string(verb) + "\"";
}

std::unique_ptr<std::istream> Dashboard::recording() const {
    const std::lock_guard lock(mutex_);
    if (recorded_to_.empty()) return nullptr;
    return std::make_unique<std::ifstream>(recorded_to_, std::ios::binary);
}

}  // namespace shiftrig::serve
