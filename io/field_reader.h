// Reads a YAML map into a struct by the struct's field list (model_fields.h):
//
//     template <class Fields>
//     void fields(Fields& f, plant::Damper& damper) {
//         f.link("a", damper.a, "first mass");
//         f.number("damping_nm_s_per_rad", damper.damping, rules::positive, "torque per slip speed");
//     }
//
// The same list, given to a FieldSchema instead, becomes the JSON Schema. Values are converted to SI by
// the suffix of their key (units.h). A misspelt key is reported before a missing one, because it is
// usually the reason for it; hence finish() after the list has run.
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "io/model_file.h"
#include "io/nearest.h"
#include "io/rule.h"
#include "io/scenario_file.h"
#include "io/units.h"
#include "io/yaml_document.h"

namespace shiftrig::io {

// One of several ways to say a thing, told apart by its leading key.
struct Alternative {
    const char* key;
    std::function<void()> list;
};

template <class Value>
using Choices = std::vector<std::pair<const char*, Value>>;

// The word by which a device names the housing as its end: no mass may be called so.
inline constexpr const char* housing = "housing";

// What all readers of one file share.
struct ReadContext {
    std::string path;
    std::vector<Place> places;
};

class FieldReader {
  public:
    // kind and device name the owner in messages: `clutch "F2": `; prefix is the path of a nested map.
    FieldReader(ReadContext& context, const YAML::Node& map, const YAML::Mark& at, std::string kind,
                std::string device, std::string prefix = "")
        : context_(context),
          kind_(std::move(kind)),
          device_(std::move(device)),
          prefix_(std::move(prefix)),
          at_(at),
          entries_(entries(context.path, map, at, owner() + prefix_dotless())) {
        for (const auto& entry : entries_)
            context_.places.push_back({kind_, device_, prefix_ + entry.key, as_written(entry.value),
                                       entry.mark.line + 1, entry.mark.column + 1});
    }

    // ---- numbers, flags, words -----------------------------------------------------------------------
    void number(const char* key, double& value, const Rule& rule, const char*) {
        if (const Entry* entry = required(key)) value = factor(key) * checked(*entry, key, rule);
    }
    void optional_number(const char* key, double& value, const Rule& rule, const char*) {
        if (const Entry* entry = take(key)) value = factor(key) * checked(*entry, key, rule);
    }
    void integer(const char* key, int& value, const Rule& rule, const char*) {
        if (const Entry* entry = required(key)) value = whole(*entry, key, rule);
    }
    void optional_integer(const char* key, int& value, const Rule& rule, const char*) {
        if (const Entry* entry = take(key)) value = whole(*entry, key, rule);
    }
    void flag(const char* key, bool& value, const char*) {
        if (const Entry* entry = take(key); entry && !YAML::convert<bool>::decode(entry->value, value))
            refuse(*entry, key, "must be true or false");
    }
    void text(const char* key, std::string& value, const char*) {
        if (const Entry* entry = required(key)) value = word(*entry, key);
    }
    void optional_text(const char* key, std::string& value, const char*) {
        if (const Entry* entry = take(key)) value = word(*entry, key);
    }
    template <class Value>
    void choice(const char* key, Value& value, const Choices<Value>& choices, const char*) {
        const Entry* entry = take(key);
        if (!entry) return;
        const std::string given = word(*entry, key);
        std::string known;
        for (const auto& [name, meaning] : choices) {
            if (given == name) {
                value = meaning;
                return;
            }
            known += (known.empty() ? "" : ", ") + std::string(name);
        }
        refuse(*entry, key, "must be one of " + known);
    }

    // ---- links and names -----------------------------------------------------------------------------
    // Whether the mass exists is plant::validate's to say: it knows the regularity rule.
    void link(const char* key, std::string& value, const char*) {
        if (const Entry* entry = required(key)) value = word(*entry, key);
    }
    // A mass, or the word housing, which becomes the empty name.
    void link_or_housing(const char* key, std::string& value, const char*) {
        if (const Entry* entry = required(key)) value = word(*entry, key);
        if (value == housing) value.clear();
    }
    void names(const char* key, std::vector<std::string>& values, const char*) {
        if (const Entry* entry = required(key)) read_names(*entry, key, values);
    }
    void optional_names(const char* key, std::vector<std::string>& values, const char*) {
        if (const Entry* entry = take(key)) read_names(*entry, key, values);
    }
    // {name: word, …}
    void named_words(const char* key, std::vector<std::pair<std::string, std::string>>& values, const char*) {
        const Entry* entry = take(key);
        if (!entry) return;
        for (const auto& item :
             entries(context_.path, entry->value, entry->mark, owner() + prefix_ + key + " "))
            values.emplace_back(item.key, word(item, std::string(key) + "." + item.key));
    }

    // ---- tables --------------------------------------------------------------------------------------
    // [[x, y], …], x rising; the units of both columns stand in the key, their factors are given here.
    void table(const char* key, std::vector<std::pair<double, double>>& points, double x_factor,
               double y_factor, const char*, const Columns& columns = {}) {
        if (const Entry* entry = required(key)) read_table(*entry, key, points, x_factor, y_factor, columns);
    }
    void optional_table(const char* key, std::vector<std::pair<double, double>>& points, double x_factor,
                        double y_factor, const char*, const Columns& columns = {}) {
        if (const Entry* entry = take(key)) read_table(*entry, key, points, x_factor, y_factor, columns);
    }
    // {name: number, …}
    void named_numbers(const char* key, std::vector<std::pair<std::string, double>>& values, const Rule& rule,
                       const char*) {
        const Entry* entry = required(key);
        if (!entry) return;
        for (const auto& item :
             entries(context_.path, entry->value, entry->mark, owner() + prefix_ + key + " "))
            values.emplace_back(item.key, checked(item, std::string(key) + "." + item.key, rule));
        if (values.empty()) refuse(*entry, key, "must name at least one");
    }

    // ---- nested maps and lists -----------------------------------------------------------------------
    template <class Struct>
    void object(const char* key, Struct& value, const char*) {
        if (const Entry* entry = required(key)) read_nested(*entry, key, value);
    }
    template <class Struct>
    void optional_object(const char* key, std::optional<Struct>& value, const char*) {
        if (const Entry* entry = take(key)) read_nested(*entry, key, value.emplace());
    }
    template <class Struct>
    void optional_object(const char* key, Struct& value, const char*) {
        if (const Entry* entry = take(key)) read_nested(*entry, key, value);
    }
    template <class Struct>
    void list(const char* key, std::vector<Struct>& values, const char*) {
        const Entry* entry = take(key);
        if (!entry) return;
        if (!entry->value.IsSequence()) refuse(*entry, key, "must be a list");
        for (const auto& item : entry->value) {
            FieldReader inner(context_, item, item.Mark(), kind_, device_, prefix_ + key + ".");
            auto& value = values.emplace_back();
            note_place(value, item.Mark());
            fields(inner, value);
            inner.finish();
        }
    }
    // {name: {…}, …}: devices by name, in file order.
    template <class Struct>
    void section(const char* key, const char* kind, std::vector<Struct>& values, const char*) {
        const Entry* entry = take(key);
        if (!entry) return;
        for (const auto& item : entries(context_.path, entry->value, entry->mark, std::string(key) + " ")) {
            if (item.key.empty() || item.key.find_first_not_of(name_letters) != std::string::npos)
                fail(context_.path, item.mark,
                     std::string(kind) + " \"" + item.key + "\": a name is made of letters, digits and _");
            if (kind == std::string("mass") && item.key == housing)
                fail(context_.path, item.mark,
                     "mass \"housing\": the word stands for the fixed housing, and can be no mass's name");
            context_.places.push_back({kind, item.key, "", "", item.mark.line + 1, item.mark.column + 1});
            Struct& value = values.emplace_back();
            value.name = item.key;
            FieldReader inner(context_, item.value, item.mark, kind, item.key);
            fields(inner, value);
            inner.finish();
        }
    }
    // Exactly one of several.
    void one_of(const std::vector<Alternative>& alternatives) {
        const Alternative* chosen = nullptr;
        std::string keys;
        for (const auto& alternative : alternatives) {
            keys += (keys.empty() ? "" : ", ") + std::string(alternative.key);
            known_.push_back(alternative.key);
            const Entry* entry = find(alternative.key);
            if (!entry) continue;
            if (chosen)
                fail(context_.path, entry->mark,
                     owner() + prefix_ + alternative.key + " and " + chosen->key + " exclude each other");
            chosen = &alternative;
        }
        if (chosen)
            chosen->list();
        else if (missing_.empty())
            missing_ = owner() + prefix_ + "needs one of " + keys;
    }
    // ---- signals with their unit as a suffix (scenarios) ---------------------------------------------
    void quantity(const char* key, NamedQuantity& value, const char*) {
        const Entry* entry = required(key);
        if (entry) value = named_quantity(word(*entry, key), entry->value.Mark());
    }
    // {signal_with_unit: number, …}
    void settings(const char* key, std::vector<Setting>& values, const char*) {
        const Entry* entry = take(key);
        if (!entry) return;
        for (const auto& item :
             entries(context_.path, entry->value, entry->mark, owner() + prefix_ + key + " "))
            values.push_back(setting(item, std::string(key) + "." + item.key));
    }
    // Every key not taken so far that looks like a signal: with a dot in it.
    void other_settings(std::vector<Setting>& values, const char*) {
        for (const auto& entry : entries_) {
            if (taken_.contains(entry.key) || entry.key.find('.') == std::string::npos) continue;
            taken_.insert(entry.key);
            values.push_back(setting(entry, entry.key));
        }
    }
    // What somebody may look for here though it stands elsewhere.
    void no_key(const char* key, const char* elsewhere) const {
        if (const Entry* entry = find(key))
            fail(context_.path, entry->mark, owner() + prefix_ + key + " is not a known key; " + elsewhere);
    }
    // A part that another reader understands; undefined where absent.
    void raw(const char* key, YAML::Node& value, const char*) {
        if (const Entry* entry = take(key)) value.reset(entry->value);
    }

    void finish() const {
        for (const auto& entry : entries_)
            if (!taken_.contains(entry.key))
                fail(context_.path, entry.mark,
                     owner() + prefix_ + entry.key + " is not a known key" + nearest_hint(entry.key, known_));
        if (!missing_.empty()) fail(context_.path, at_, missing_);
    }

  private:
    static constexpr const char* name_letters =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";

    std::string owner() const {
        if (device_.empty()) return kind_.empty() ? "" : kind_ + ": ";
        return kind_ + " \"" + device_ + "\": ";
    }
    std::string prefix_dotless() const {
        return prefix_.empty() ? "" : prefix_.substr(0, prefix_.size() - 1) + " ";
    }
    static double factor(const char* key) {
        const UnitSpelling* spelling = unit_spelling(key);
        return spelling ? spelling->factor : 1;
    }
    const Entry* find(const std::string& key) const {
        for (const auto& entry : entries_)
            if (entry.key == key) return &entry;
        return nullptr;
    }
    const Entry* take(const char* key) {
        known_.push_back(key);
        const Entry* entry = find(key);
        if (entry) taken_.insert(key);
        return entry;
    }
    const Entry* required(const char* key) {
        const Entry* entry = take(key);
        if (!entry && missing_.empty()) missing_ = owner() + prefix_ + key + " is missing";
        return entry;
    }
    [[noreturn]] void refuse(const Entry& entry, const std::string& key, const std::string& rule) const {
        fail(context_.path, entry.mark,
             owner() + prefix_ + key + " = " + as_written(entry.value) + "; " + rule);
    }
    double checked(const Entry& entry, const std::string& key, const Rule& rule) const {
        double value = 0;
        if (!YAML::convert<double>::decode(entry.value, value)) refuse(entry, key, "must be a number");
        if (!std::isfinite(value)) refuse(entry, key, rules::any.words());
        if (!rule.holds(value)) refuse(entry, key, rule.words());
        return value;
    }
    int whole(const Entry& entry, const std::string& key, const Rule& rule) const {
        int value = 0;
        if (!YAML::convert<int>::decode(entry.value, value)) refuse(entry, key, "must be a whole number");
        if (!rule.holds(value)) refuse(entry, key, rule.words());
        return value;
    }
    std::string word(const Entry& entry, const std::string& key) const {
        if (!entry.value.IsScalar() || entry.value.Scalar().empty()) refuse(entry, key, "must be a word");
        return entry.value.Scalar();
    }
    void read_table(const Entry& entry, const char* key, std::vector<std::pair<double, double>>& points,
                    double x_factor, double y_factor, const Columns& columns) const {
        if (!entry.value.IsSequence() || entry.value.size() < 2)
            refuse(entry, key, "must be a list of at least two pairs [x, y]");
        for (const auto& row : entry.value) {
            const auto refuse_row = [&](const std::string& rule) {
                fail(context_.path, row.Mark(),
                     owner() + prefix_ + key + " = " + as_written(row) + "; " + rule);
            };
            std::pair<double, double> point;
            if (!row.IsSequence() || row.size() != 2 || !YAML::convert<double>::decode(row[0], point.first) ||
                !YAML::convert<double>::decode(row[1], point.second) || !rules::any.holds(point.first) ||
                !rules::any.holds(point.second))
                refuse_row("must be a pair of numbers [x, y]");
            if (!columns.x.holds(point.first)) refuse_row("x " + columns.x.words());
            if (!columns.y.holds(point.second)) refuse_row("y " + columns.y.words());
            point.first *= x_factor;
            point.second *= y_factor;
            if (!points.empty() && point.first <= points.back().first)
                refuse_row("x must rise from pair to pair");
            points.push_back(point);
        }
    }
    void read_names(const Entry& entry, const char* key, std::vector<std::string>& values) const {
        if (!entry.value.IsSequence()) refuse(entry, key, "must be a list of names");
        for (const auto& item : entry.value) {
            if (!item.IsScalar()) refuse(entry, key, "must be a list of names");
            values.push_back(item.Scalar());
        }
    }
    static NamedQuantity named_quantity(const std::string& written, const YAML::Mark& mark) {
        NamedQuantity quantity{written, written, plant::Unit::one, 1, mark.line + 1, mark.column + 1};
        if (const UnitSpelling* spelling = unit_spelling(written); spelling && spelling->unit) {
            quantity.signal.resize(written.size() - spelling->suffix.size());
            quantity.unit = *spelling->unit;
            quantity.factor = spelling->factor;
        }
        return quantity;
    }
    Setting setting(const Entry& entry, const std::string& path) const {
        const NamedQuantity quantity = named_quantity(entry.key, entry.mark);
        return {quantity, quantity.factor * checked(entry, path, rules::any)};
    }
    // Items that keep their own place, for errors and verdicts found later.
    template <class Struct>
    static void note_place(Struct& value, const YAML::Mark& mark) {
        if constexpr (requires { value.line, value.column; }) {
            value.line = mark.line + 1;
            value.column = mark.column + 1;
        }
    }
    template <class Struct>
    void read_nested(const Entry& entry, const char* key, Struct& value) {
        FieldReader inner(context_, entry.value, entry.mark, kind_, device_, prefix_ + key + ".");
        fields(inner, value);
        inner.finish();
    }

    ReadContext& context_;
    std::string kind_, device_, prefix_;
    YAML::Mark at_;
    std::vector<Entry> entries_;
    std::vector<std::string> known_;
    std::set<std::string> taken_;
    std::string missing_;  // the first thing that should be there
};

}  // namespace shiftrig::io
