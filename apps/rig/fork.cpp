#include "apps/rig/fork.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "apps/rig/snapshot.h"
#include "io/recording/csv.h"
#include "io/signals.h"
#include "io/units.h"
#include "io/yaml_document.h"

namespace shiftrig::rig {

namespace {

// One thread's rig, brought back to the snapshot for every branch.
class Brancher {
  public:
    Brancher(const io::Manifest& snapshot, const Plan& plan, const ForkOptions& options)
        : snapshot_(snapshot),
          plan_(plan),
          setup_(setup_of(snapshot)),
          limits_(analysis::default_limits()),
          run_(history_of(snapshot)) {
        if (!setup_.buses.built_in)
            throw io::InputError(
                "the snapshot's controller was not the built-in one: its state is not in the snapshot");
        if (!setup_.buses.calibration_path.empty())
            calibration_.emplace(setup_.buses.calibration_text, setup_.buses.calibration_path);
        for (const auto& v : plan.variations()) rebuilds_ = rebuilds_ || v.target == Variation::Target::model;
        if (rebuilds_) model_.emplace(snapshot.model_text, snapshot.model_path);
        for (const auto& v : plan.variations())
            recalibrates_ = recalibrates_ || v.target == Variation::Target::calibration;
        set_keys(plan.values(0));  // a key that is not there is not there in any branch
        rig_ = std::make_unique<Rig>(setup_);
        resume(*rig_, snapshot);  // if it does not fit, no branch can run
        ticks_ = std::llround(options.duration * 1e9 / static_cast<double>(setup_.tick_ns));
        for (const auto& v : plan.variations())
            signals_.push_back(v.target == Variation::Target::signal ? found(v) : Settable{});
        refuse_repeated();

        // The history's columns that the rig still has, with room for the branch.
        run_.machine = setup_.model.description;
        std::erase_if(run_.columns,
                      [&](const analysis::Column& c) { return rig_->signals().find(c.signal.name) < 0; });
        history_rows_ = run_.time.size();
        for (auto& column : run_.columns) {
            indices_.push_back(rig_->signals().find(column.signal.name));
            column.signal = rig_->signals().signal(indices_.back());
            column.value.resize(history_rows_ + static_cast<std::size_t>(ticks_));
        }
        run_.time.resize(history_rows_ + static_cast<std::size_t>(ticks_));
    }

    Branch run(std::int64_t number) {
        Branch branch;
        branch.number = number;
        branch.values = plan_.values(number);
        try {
            prepare(branch.values);
        } catch (const std::exception& error) {
            branch.refused = true;
            branch.error = error.what();
            rig_ = std::make_unique<Rig>(setup_);
            return branch;
        }
        RunCertificate certificate;
        for (std::size_t row = history_rows_; row < run_.time.size(); ++row) {
            rig_->tick();
            run_.time[row] = rig_->sim_time();
            for (std::size_t c = 0; c < indices_.size(); ++c)
                run_.columns[c].value[row] = rig_->value(indices_[c]);
            certificate.take(rig_->certificate());
        }
        if (!certificate.is_finite()) {  // nothing to judge
            branch.error = "in " + std::to_string(certificate.flagged[2]) + " of " +
                           std::to_string(certificate.ticks) + " ticks the state is not finite";
            rig_ = std::make_unique<Rig>(setup_);
            return branch;
        }
        judge(branch);
        return branch;
    }

  private:
    struct Settable {
        int signal = -1;
        double factor = 1;
    };

    Settable find(const std::string& name) const {
        const auto& table = rig_->signals();
        if (const int signal = table.find(name); signal >= 0 && table.signal(signal).unit == plant::Unit::one)
            return {signal, 1};
        if (const auto* unit = io::unit_spelling(name)) {
            const int signal = table.find(name.substr(0, name.size() - unit->suffix.size()));
            if (signal >= 0 && unit->unit == table.signal(signal).unit) return {signal, unit->factor};
        }
        if (const int signal = table.find(name); signal >= 0)
            throw io::InputError("--vary " + name + ": must be written with its unit: " + name + " ends in " +
                                 io::suffixes_of(table.signal(signal).unit));
        std::string near;
        for (const auto& known : table.nearest(name))
            near += (near.empty() ? "" : ", ") + io::column_name(table.signal(table.find(known)));
        throw io::InputError("--vary " + name +
                             ": no such signal, or not with its unit's suffix; nearest: " + near);
    }

    // The signal varied, within its range in every branch.
    Settable found(const Variation& v) const {
        const Settable settable = find(v.name);
        if (!rig_->is_settable(settable.signal))
            throw io::InputError("--vary " + v.name + ": this signal is not the user's to set");
        const auto& signal = rig_->signals().signal(settable.signal);
        const bool whole = takes_whole_numbers(signal.name);
        if (whole && v.values.empty())
            throw io::InputError("--vary " + v.name + ": takes whole numbers; write NAME=A,B,C");
        for (const double value : v.values.empty() ? std::vector{v.low, v.high} : v.values) {
            const double wanted = value * (v.relative ? rig_->value(settable.signal) : settable.factor);
            const auto refuse = [&](const std::string& rule) {
                throw io::InputError("--vary " + v.name + " = " + io::in_digits(wanted / settable.factor) +
                                     "; " + rule);
            };
            if (!io::rule_of(signal).holds(wanted)) refuse(io::rule_of(signal, settable.factor).words());
            if (whole && wanted != std::floor(wanted)) refuse("must be a whole number");
        }
        return settable;
    }

    // Of two values for one thing only the last would count, whatever the table of branches says.
    void refuse_repeated() const {
        const auto& all = plan_.variations();
        for (std::size_t i = 0; i < all.size(); ++i)
            for (std::size_t j = 0; j < i; ++j) {
                const bool same =
                    all[i].target == Variation::Target::signal
                        ? all[j].target == all[i].target && signals_[j].signal == signals_[i].signal
                        : all[j].target == all[i].target && all[j].name == all[i].name;
                if (same)
                    throw io::InputError("--vary " + full_name(all[i]) + ": is varied already" +
                                         (all[j].name == all[i].name ? "" : ", as " + full_name(all[j])));
            }
    }

    // The branch's values in the texts of the model and the calibration.
    void set_keys(const std::vector<double>& values) {
        const auto& variations = plan_.variations();
        for (std::size_t i = 0; i < values.size(); ++i) {
            const Variation& v = variations[i];
            if (v.target == Variation::Target::model) model_->set(v.name, values[i], v.relative);
            if (v.target == Variation::Target::calibration) calibration_->set(v.name, values[i], v.relative);
        }
    }

    void prepare(const std::vector<double>& values) {
        const auto& variations = plan_.variations();
        set_keys(values);
        if (rebuilds_) {
            Setup setup = setup_;
            io::replace(setup.model, io::parse_model(model_->text(), snapshot_.model_path));
            for (const auto& [gear, option] : snapshot_.overrides)
                io::select_option(setup.model.description, gear, option);
            rig_ = std::make_unique<Rig>(std::move(setup));
        }
        resume(*rig_, snapshot_);
        if (recalibrates_) {
            rig_->buses().recalibrate(
                tcu::parse_calibration(calibration_->root(), setup_.buses.calibration_path));
        }
        for (std::size_t i = 0; i < values.size(); ++i) {
            if (variations[i].target != Variation::Target::signal) continue;
            const double wanted = variations[i].relative ? values[i] * rig_->value(signals_[i].signal)
                                                         : values[i] * signals_[i].factor;
            if (!rig_->request(signals_[i].signal, wanted))
                throw io::InputError("--vary " + variations[i].name + ": more signals than a tick takes");
        }
    }

    void judge(Branch& branch) const {
        const analysis::Scorecard card = analysis::score(run_, limits_);
        if (card.shifts.empty()) return;
        const analysis::ShiftScore& score = card.shifts.back();
        branch.shifted = true;
        branch.completed = score.shift.completed();
        branch.verdict = score.verdict;
        branch.metrics = score.metrics;
        int judged = 0;
        for (const auto& metric : score.metrics) {
            const analysis::Limit* limit = limits_.find(metric.name, score.shift.kind);
            if (!metric.value || !limit || limit->reject == 0) continue;
            branch.burden += *metric.value / limit->reject;
            ++judged;
        }
        if (judged > 0) branch.burden /= judged;
    }

    const io::Manifest& snapshot_;
    const Plan& plan_;
    const Setup setup_;
    const analysis::Limits limits_;
    analysis::Run run_;
    std::optional<YamlVariant> calibration_, model_;  // of each branch anew: every branch sets the same keys
    bool rebuilds_ = false, recalibrates_ = false;
    std::unique_ptr<Rig> rig_;
    std::int64_t ticks_ = 0;
    std::size_t history_rows_ = 0;
    std::vector<Settable> signals_;  // by variation
    std::vector<int> indices_;       // by column
};

bool better(const Branch& a, const Branch& b) {
    if (a.error.empty() != b.error.empty()) return a.error.empty();
    if (a.completed != b.completed) return a.completed;
    if (a.shifted != b.shifted) return a.shifted;
    if (a.verdict != b.verdict) return a.verdict < b.verdict;
    if (a.burden != b.burden) return a.burden < b.burden;
    return a.number < b.number;
}

}  // namespace

std::vector<Branch> fork(const io::Manifest& snapshot, const Plan& plan, const ForkOptions& options,
                         std::atomic<std::int64_t>& done) {
    std::vector<Branch> branches(static_cast<std::size_t>(plan.branches()));
    std::atomic<std::int64_t> next{0};
    std::mutex mutex;
    std::exception_ptr failure;
    const auto work = [&] {
        try {
            Brancher brancher(snapshot, plan, options);
            for (std::int64_t n = next++; n < plan.branches(); n = next++) {
                branches[static_cast<std::size_t>(n)] = brancher.run(n);
                ++done;
            }
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (!failure) failure = std::current_exception();
            next = plan.branches();
        }
    };
    const int threads = options.threads > 0
                            ? options.threads
                            : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    std::vector<std::thread> workers;
    for (int i = 0; i < threads; ++i) workers.emplace_back(work);
    for (auto& worker : workers) worker.join();
    if (failure) std::rethrow_exception(failure);
    std::sort(branches.begin(), branches.end(), better);
    return branches;
}

}  // namespace shiftrig::rig
