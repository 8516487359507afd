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

// A result says itself whether its run came to its end and could be judged (`run --json`, `test --json`).
void require_whole(const json& result, const std::string& where) {
    if (const auto loop = result.find("loop"); loop != result.end() && loop->is_object()) {
        const std::string outcome = loop->value("outcome", json("completed")).dump();
        if (outcome != "\"completed\"")
            throw io::InputError(where + " did not come to its end (outcome " + outcome + ")" + only_whole);
    }
    if (const auto error = result.find("error"); error != result.end() && error->is_string())
        throw io::InputError(where + " could not be judged: " + error->get<std::string>());
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

class ResultSet {
  public:
    explicit ResultSet(const Limits& limits) : limits_(limits) {}

    void read_file(const fs::path& path) {
        if (io::looks_like_recording(path.string())) {
            const plant::Description machine =
                io::recorded_model_file(io::RecordingReader(path.string()).manifest()).description;
            const Run run = load_run(path.string(), scorecard_signals(machine));
            if (const auto why = run.incomplete(); !why.empty()) throw io::InputError(why + only_whole);
            add(run_name(path), to_json(score(run, limits_)), path.string());
            return;
        }
        const json document = json::parse(io::read_text(path.string()), nullptr, false);
        if (document.is_discarded()) throw io::InputError(path.string() + ": neither a recording nor JSON");
        take(document, run_name(path), path.string());
    }

    json runs = json::object();

  private:
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
            require_whole(document, path + ": run \"" + own + "\"");
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
    void add(const std::string& name, const json& shifts, const std::string& path) {
        const auto [place, is_new] = files_.emplace(name, path);
        if (!is_new)
            throw io::InputError(path + ": run \"" + name + "\" is there already, from " + place->second +
                                 "; runs are told apart by name");
        for (std::size_t i = 0; i < shifts.size(); ++i)
            check_shift(shifts[i], path + ": run \"" + name + "\", shift " + std::to_string(i + 1));
        runs[name] = shifts;
    }

    const Limits& limits_;
    std::map<std::string, std::string> files_;  // run → the file it is from
};

}  // namespace

json read_results(const std::string& path, const Limits& limits) {
    ResultSet set(limits);
    std::error_code error;
    if (!fs::is_directory(path, error)) {
        if (!fs::exists(path, error)) throw io::InputError(path + ": no such file");
        set.read_file(path);
        return std::move(set.runs);
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
    for (const fs::path& file : files) set.read_file(file);
    return std::move(set.runs);
}

}  // namespace shiftrig::analysis
