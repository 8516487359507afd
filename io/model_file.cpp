#include "io/model_file.h"

#include <algorithm>
#include <stdexcept>

#include "io/field_reader.h"
#include "io/field_schema.h"
#include "io/model_fields.h"
#include "plant/connectors.h"
#include "plant/validation.h"

namespace shiftrig::io {

namespace {

constexpr double default_safe_time = 0.05;  // [s]

class ModelReader {
  public:
    ModelReader(const std::string& text, const std::string& path) {
        file_.path = path;
        file_.text = text;
        context_.path = path;
    }

    ModelFile read() {
        const YAML::Node root = parse_yaml(file_.text, file_.path);
        if (root.IsMap() && root["model"] && !root["masses"])
            throw InputError(file_.path, 0, 0, "names a model and has no masses: a scenario, for --scenario");
        FieldReader reader(context_, root, root.Mark(), "", "");
        fields(reader, model_);
        reader.finish();

        file_.description = std::move(model_.machine);
        file_.places = std::move(context_.places);
        file_.can = model_.can;
        for (const auto& clutch : file_.description.clutches) clutches_.push_back(clutch.name);
        plant::for_each_connector(file_.description, [this](const auto& connector) {
            if (may_be_closed(connector)) closable_.push_back(connector.name);
        });
        for (const auto& mass : file_.description.masses) masses_.push_back(mass.name);
        check_options();
        take_gear_paths();
        take_controller();
        check_mass("input_mass", file_.description.input_mass);
        check_mass("output_mass", file_.description.output_mass);
        try {
            plant::validate(file_.description);
        } catch (const plant::ModelError& error) {
            throw located(file_, error);
        }
        return std::move(file_);
    }

  private:
    [[noreturn]] void refuse(const std::string& kind, const std::string& device, const std::string& key,
                             const std::string& what) const {
        const std::string owner = device.empty() ? "" : kind + " \"" + device + "\": ";
        for (const auto& place : file_.places)
            if (place.kind == kind && place.device == device && place.key == key)
                throw InputError(file_.path, place.line, place.column, owner + what);
        throw InputError(file_.path, 1, 1, owner + what);
    }

    void check_options() const {
        for (const auto& gear : file_.description.gears)
            if (!gear.options.empty() && gear.ratio == 0)
                refuse("gear", gear.name, "in_use", "in_use must be one of its options");
    }

    void check_name(const std::string& kind, const std::string& device, const std::string& key,
                    const std::string& name, const std::vector<std::string>& known, const char* what) const {
        if (std::find(known.begin(), known.end(), name) == known.end())
            refuse(kind, device, key,
                   (key.empty() ? "" : key + " = " + name + "; ") + "must name " + what +
                       nearest_hint(name, known));
    }
    void check_clutch(const std::string& kind, const std::string& device, const std::string& key,
                      const std::string& name) const {
        check_name(kind, device, key, name, clutches_, "a clutch");
    }

    void check_mass(const char* key, const std::string& name) const {
        if (!name.empty() && std::find(masses_.begin(), masses_.end(), name) == masses_.end())
            refuse("", "", key,
                   std::string(key) + " = " + name + "; must name a mass" + nearest_hint(name, masses_));
    }

    void take_gear_paths() {
        for (const auto& path : model_.gear_paths) {
            for (auto device = path.closed.begin(); device != path.closed.end(); ++device) {
                check_name("gear path", path.name, "closed", *device, closable_, "a clutch");
                if (std::find(path.closed.begin(), device, *device) != device)
                    refuse("gear path", path.name, "closed", "closed = " + *device + "; must be named once");
            }
            file_.description.gear_paths.push_back({path.name, path.closed});
            if (path.lever == 0) continue;
            for (const auto& other : file_.controller.lever)
                if (other.lever == path.lever)
                    refuse("gear path", path.name, "lever",
                           "lever = " + std::to_string(path.lever) + "; is taken by \"" + other.gear_path +
                               "\"");
            file_.controller.lever.push_back({path.lever, path.name});
        }
    }

    void take_controller() {
        const ControllerText& text = model_.controller;
        file_.controller.command_timeout = text.command_timeout;
        file_.controller.pedal_clutch = text.pedal_clutch;
        if (!text.pedal_clutch.empty()) {
            check_clutch("", "", "controller.pedal_clutch", text.pedal_clutch);
            if (command_of(text.pedal_clutch) != "release_command")
                refuse("", "", "controller.pedal_clutch",
                       "controller.pedal_clutch = " + text.pedal_clutch + "; must be a clutch with release");
        }
        for (const auto& safe : text.safe_command) check_clutch("safe command", safe.name, "", safe.name);
        for (const auto& clutch : file_.description.clutches) take_safe_command(clutch.name);
    }

    void take_safe_command(const std::string& clutch) {
        const std::string command = command_of(clutch);
        const auto& given = model_.controller.safe_command;
        const auto own =
            std::find_if(given.begin(), given.end(), [&](const auto& safe) { return safe.name == clutch; });
        if (own != given.end() && own->command != command)
            refuse("safe command", clutch, "",
                   command.empty() ? "this clutch takes no command" : "must set its " + command);
        if (command.empty()) return;
        const double open = command == "release_command" ? 1 : 0;
        file_.controller.safe_commands.push_back(
            own != given.end()
                ? SafeCommand{clutch, "clutch." + clutch + "." + command, own->value, own->within}
                : SafeCommand{clutch, "clutch." + clutch + "." + command, open, default_safe_time});
    }

    // The input by which the controller commands a clutch; empty if it has none.
    std::string command_of(const std::string& name) const {
        for (const auto& clutch : file_.description.clutches) {
            if (clutch.name != name) continue;
            if (const auto* hydraulic = std::get_if<plant::ActuationHydraulic>(&clutch.actuation))
                return hydraulic->solenoid ? "current_command" : "pressure_command";
            if (std::holds_alternative<plant::ActuationRelease>(clutch.actuation)) return "release_command";
            if (const auto* apply = std::get_if<plant::ActuationApply>(&clutch.actuation))
                return apply->by_driver_brake ? "" : "application_command";
            if (const auto* direct = std::get_if<plant::ActuationDirect>(&clutch.actuation))
                return direct->profile.pieces.empty() ? "engagement" : "";
        }
        return "";
    }

    ModelFile file_;
    ModelText model_;
    ReadContext context_;
    std::vector<std::string> masses_, clutches_, closable_;
};

// A ModelError's field is a member of plant/description.h; the key is that name with its unit.
bool names_field(const std::string& key, const std::string& field) {
    const auto last = [](const std::string& path) { return path.substr(path.rfind('.') + 1); };
    const std::string leaf = last(key), member = last(field);
    return leaf == member || leaf.starts_with(member + "_");
}

}  // namespace

ModelFile parse_model(const std::string& text, const std::string& path) {
    return ModelReader(text, path).read();
}

ModelFile read_model(const std::string& path) {
    return parse_model(read_text(path), path);
}

InputError located(const ModelFile& file, const plant::ModelError& error) {
    // What plant/ calls the machine or its oil stands at the top of the file; a brake stands among the clutches.
    const bool top = error.kind == "model" || error.kind == "oil";
    const std::string kind = top ? "" : error.kind == "brake" ? "clutch" : error.kind;
    const std::string device = top ? "" : error.device;

    const Place* place = nullptr;  // the key where one fits, else the device's own line
    for (const auto& candidate : file.places) {
        if (candidate.kind != kind || candidate.device != device) continue;
        if (candidate.key.empty() ? !place : !error.field.empty() && names_field(candidate.key, error.field))
            place = &candidate;
    }
    std::string what = top ? "" : error.kind + " \"" + error.device + "\": ";
    std::string rule = error.rule;
    if (place && !place->key.empty()) {
        what += place->key + " ";
        // plant/ speaks SI; the user shall read what he wrote.
        if (const auto end = rule.find(';'); rule.starts_with("= ") && end != std::string::npos)
            rule = "= " + place->written + rule.substr(end);
    } else if (!error.field.empty()) {
        what += error.field + " ";
    }
    if (rule.ends_with("is not a mass") && place) {
        std::vector<std::string> masses;
        for (const auto& mass : file.description.masses) masses.push_back(mass.name);
        rule += nearest_hint(place->written, masses);
    }
    return place ? InputError(file.path, place->line, place->column, what + rule)
                 : InputError(file.path, 1, 1, what + rule);
}

void select_option(plant::Description& description, const std::string& gear, const std::string& option) {
    for (auto& candidate : description.gears) {
        if (candidate.name != gear || candidate.options.empty()) continue;
        std::string known;
        for (const auto& [name, ratio] : candidate.options) {
            if (name == option) {
                candidate.ratio = ratio;
                return;
            }
            known += (known.empty() ? "" : ", ") + name;
        }
        throw std::invalid_argument("gear \"" + gear + "\": no option \"" + option + "\"; there are " +
                                    known);
    }
    throw std::invalid_argument("no gear \"" + gear + "\" with options");
}

nlohmann::ordered_json model_schema() {
    nlohmann::ordered_json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                                     {"title", "shiftrig model"}};
    schema.update(FieldSchema::of<ModelText>());
    return schema;
}

}  // namespace shiftrig::io
