#include "analysis/result_set.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "analysis/load_run.h"
#include "analysis/scorecard.h"
#include "io/input_error.h"
#include "io/recording/reader.h"
#include "io/recording/rebuild.h"
#include "io/text_file.h"

namespace shiftrig::analysis {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A file's name without what says its kind: shift.v1 of out/shift.v1.lcmlog.zst.
std::string run_name(const fs::path& path) {
    const std::string file = path.filename().string();
    for (const std::string ending : {".lcmlog.zst", ".lcmlog", ".json", ".yaml"}) {
        if (file.size() > ending.size() && file.ends_with(ending))
            return file.substr(0, file.size() - ending.size());
    }
    return file;
}

// Of half a run, half of what happened is told: what went missing with the rest would pass for better.
constexpr const char* only_whole = "; only whole runs are compared";

// A result says itself whether its run came to its end and could be judged (`run --json`, `test --json`): why it is not
// whole; empty if it is.
std::string incomplete(const json& result, const std::string& where) {
    if (const auto loop = result.find("loop"); loop != result.end() && loop->is_object()) {
        const std::string outcome = loop->value("outcome", json("completed")).dump();
        if (outcome != "\"completed\"")
            return where + " did not come to its end (outcome " + outcome + ")" + only_whole;
    }
    if (const auto error = result.find("error"); error != result.end() && error->is_string())
        return where + " could not be judged: " + error->get<std::string>();
    return "";
}

// Somebody else may have written them: what is compared is held against its kind here.
void check_shift(const json& shift, const std::string& where) {
    const auto refuse = [&](const std::string& key, const json& value, const char* rule) {
        throw io::InputError(where + ": " + key + " = " + value.dump() + "; must be " + rule);
    };
    if (!shift.is_object()) refuse("it", shift, "an object");
    for (const char* key : {"from", "to"}) {
        if (!shift.contains(key)) throw io::InputError(where + ": " + key + " is missing");
    }
    for (const char* key : {"from", "to", "kind"}) {
        if (shift.contains(key) && !shift[key].is_string()) refuse(key, shift[key], "a word");
    }
    if (shift.contains("completed") && !shift["completed"].is_boolean())
        refuse("completed", shift["completed"], "true or false");
    const auto check_value = [&](const std::string& name, const json& value) {
        if (!value.is_number() && !value.is_null()) refuse(name, value, "a number or null");
    };
    for (const std::string& metric : metric_names()) {
        const auto found = shift.find(metric);
        if (found == shift.end()) continue;
        if (!found->is_object()) check_value(metric, *found);
        for (auto part = found->begin(); found->is_object() && part != found->end(); ++part)
            check_value(metric + "." + part.key(), part.value());
    }
}

class Reader {
  public:
    explicit Reader(const Limits& limits) : limits_(limits) {}

    void read_file(const fs::path& path) {
        if (io::looks_like_recording(path.string())) return take_recording(path);
        const json document = json::parse(io::read_text(path.string()), nullptr, false);
        if (document.is_discarded()) throw io::InputError(path.string() + ": neither a recording nor JSON");
        take(document, run_name(path), path.string());
    }

    // All that was read. Where nothing of it is whole, the first reason is the answer.
    ResultSet finish() {
        const auto is_null = [](const json& run) { return run.is_null(); };
        if (!set_.runs.empty() && std::all_of(set_.runs.begin(), set_.runs.end(), is_null))
            throw io::InputError(set_.not_whole.begin()->second);
        return std::move(set_);
    }

  private:
    void take_recording(const fs::path& path) {
        const std::string name = run_name(path), file = path.string();
        try {
            const plant::Description machine =
                io::recorded_model_file(io::RecordingReader(file).manifest()).description;
            const Run run = load_run(file, scorecard_signals(machine));
            for (const std::string& why : {run.incomplete(), run.unfinished})
                if (!why.empty()) return leave_out(name, why + only_whole, file);
            if (run.outcome() == "unknown")
                set_.remarks.push_back(file + ": does not say whether its run came to its end (it is of an " +
                                       "earlier version); compared as if it had");
            add(name, to_json(score(run, limits_)), file);
        } catch (const io::RecordingError& error) {  // cut or damaged before its first tick
            leave_out(name, error.what(), file);
        }
    }
    // Adds the runs of one JSON document.
    void take(const json& document, const std::string& name, const std::string& path) {
        if (document.is_array()) {
            for (std::size_t i = 0; i < document.size(); ++i)
                take(document[i], name + "#" + std::to_string(i + 1), path);
        } else if (document.is_object() && document.contains("shifts") && document["shifts"].is_array()) {
            std::string own = name;
            for (const char* key : {"name", "scenario"}) {
                if (document.contains(key) && document[key].is_string())
                    own = run_name(document[key].get<std::string>());
            }
            const std::string why = incomplete(document, path + ": run \"" + own + "\"");
            if (!why.empty()) return leave_out(own, why, path);
            add(own, document["shifts"], path);
        } else if (document.is_object() && document.contains("runs")) {
            take(document["runs"], name, path);
        } else if (document.is_object() && document.contains("scenarios")) {
            take(document["scenarios"], name, path);
        } else {
            throw io::InputError(
                path +
                ": no \"shifts\" in it; must be a result of run --json or test --json, or a recording");
        }
    }
    void require_new(const std::string& name, const std::string& path) {
        const auto [place, is_new] = files_.emplace(name, path);
        if (!is_new)
            throw io::InputError(path + ": run \"" + name + "\" is there already, from " + place->second +
                                 "; runs are told apart by name");
    }
    void add(const std::string& name, const json& shifts, const std::string& path) {
        require_new(name, path);
        for (std::size_t i = 0; i < shifts.size(); ++i)
            check_shift(shifts[i], path + ": run \"" + name + "\", shift " + std::to_string(i + 1));
        set_.runs[name] = shifts;
    }
    void leave_out(const std::string& name, const std::string& why, const std::string& path) {
        require_new(name, path);
        set_.runs[name] = nullptr;
        set_.not_whole[name] = why;
    }

    ResultSet set_;
    const Limits& limits_;
    std::map<std::string, std::string> files_;  // run → the file it is from
};

}  // namespace

ResultSet read_results(const std::string& path, const Limits& limits) {
    Reader reader(limits);
    std::error_code error;
    if (!fs::is_directory(path, error)) {
        if (!fs::exists(path, error)) throw io::InputError(path + ": no such file");
        reader.read_file(path);
        return reader.finish();
    }
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(path)) {
        const std::string file = entry.path().filename().string();
        const bool wanted =
            file.ends_with(".lcmlog") || file.ends_with(".lcmlog.zst") || file.ends_with(".json");
        if (entry.is_regular_file() && wanted) files.push_back(entry.path());
    }
    if (files.empty())
        throw io::InputError(path + ": no recording (*.lcmlog, *.lcmlog.zst) and no *.json in it");
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) reader.read_file(file);
    return reader.finish();
}

}  // namespace shiftrig::analysis
