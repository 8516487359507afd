// Turns a field list (see field_reader.h) into JSON Schema, draft 7: what an editor needs to complete and
// check a model or scenario while it is being written.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/field_reader.h"
#include "io/rule.h"

namespace shiftrig::io {

class FieldSchema {
  public:
    using json = nlohmann::ordered_json;

    // The schema of a map; call after the field list has run.
    json schema() const {
        json result = {{"type", "object"}, {"additionalProperties", false}, {"properties", properties_}};
        if (!signals_.is_null()) result["patternProperties"] = signals_;
        if (!required_.empty()) result["required"] = required_;
        if (alternatives_.size() == 1) result["oneOf"] = alternatives_.front();
        if (alternatives_.size() > 1)
            for (const auto& group : alternatives_) result["allOf"].push_back({{"oneOf", group}});
        return result;
    }

    void number(const char* key, double&, const Rule& rule, const char* text) {
        require(key, bounded("number", rule), text);
    }
    void optional_number(const char* key, double&, const Rule& rule, const char* text) {
        add(key, bounded("number", rule), text);
    }
    void integer(const char* key, int&, const Rule& rule, const char* text) {
        require(key, bounded("integer", rule), text);
    }
    void optional_integer(const char* key, int&, const Rule& rule, const char* text) {
        add(key, bounded("integer", rule), text);
    }
    void flag(const char* key, bool&, const char* text) { add(key, {{"type", "boolean"}}, text); }
    void text(const char* key, std::string&, const char* text) { require(key, word(), text); }
    void optional_text(const char* key, std::string&, const char* text) { add(key, word(), text); }
    template <class Value>
    void choice(const char* key, Value&, const Choices<Value>& choices, const char* text) {
        json names = json::array();
        for (const auto& option : choices) names.push_back(option.first);
        add(key, {{"enum", names}}, text);
    }

    void link(const char* key, std::string&, const char* text) { require(key, word(), text); }
    void link_or_housing(const char* key, std::string&, const char* text) { require(key, word(), text); }
    void names(const char* key, std::vector<std::string>&, const char* text) {
        require(key, {{"type", "array"}, {"items", word()}}, text);
    }

    void table(const char* key, std::vector<std::pair<double, double>>&, double, double, const char* text,
               const Columns& columns = {}) {
        require(key, pairs(columns), text);
    }
    void optional_table(const char* key, std::vector<std::pair<double, double>>&, double, double,
                        const char* text, const Columns& columns = {}) {
        add(key, pairs(columns), text);
    }
    void named_numbers(const char* key, std::vector<std::pair<std::string, double>>&, const Rule& rule,
                       const char* text) {
        require(key,
                {{"type", "object"}, {"additionalProperties", bounded("number", rule)}, {"minProperties", 1}},
                text);
    }

    template <class Struct>
    void object(const char* key, Struct&, const char* text) {
        require(key, of<Struct>(), text);
    }
    template <class Struct>
    void optional_object(const char* key, std::optional<Struct>&, const char* text) {
        add(key, of<Struct>(), text);
    }
    template <class Struct>
    void optional_object(const char* key, Struct&, const char* text) {
        add(key, of<Struct>(), text);
    }
    template <class Struct>
    void list(const char* key, std::vector<Struct>&, const char* text) {
        add(key, {{"type", "array"}, {"items", of<Struct>()}}, text);
    }
    template <class Struct>
    void section(const char* key, const char* kind, std::vector<Struct>&, const char* text) {
        const bool reserved = kind == std::string("mass");
        const std::string but_not = reserved ? "(?!" + std::string(housing) + "$)" : "";
        add(key,
            {{"type", "object"},
             {"propertyNames", {{"pattern", "^" + but_not + "[A-Za-z0-9_]+$"}}},
             {"additionalProperties", of<Struct>()}},
            text);
    }
    void one_of(const std::vector<Alternative>& alternatives) {
        json group = json::array();
        for (const auto& alternative : alternatives) {
            // What the alternative's list requires is required only together with it.
            json required = std::exchange(required_, json::array());
            alternative.list();
            // What tells the alternatives apart has to be there, even a flag.
            if (std::find(required_.begin(), required_.end(), alternative.key) == required_.end())
                required_.push_back(alternative.key);
            group.push_back({{"required", std::exchange(required_, std::move(required))}});
        }
        alternatives_.push_back(std::move(group));
    }
    void optional_names(const char* key, std::vector<std::string>&, const char* text) {
        add(key, {{"type", "array"}, {"items", word()}}, text);
    }
    void named_words(const char* key, std::vector<std::pair<std::string, std::string>>&, const char* text) {
        add(key, {{"type", "object"}, {"additionalProperties", word()}}, text);
    }
    void quantity(const char* key, NamedQuantity&, const char* text) { require(key, word(), text); }
    void settings(const char* key, std::vector<Setting>&, const char* text) {
        add(key, {{"type", "object"}, {"additionalProperties", {{"type", "number"}}}}, text);
    }
    void other_settings(std::vector<Setting>&, const char* text) {
        signals_ = {{"[.]", {{"type", "number"}, {"description", text}}}};
    }
    void no_key(const char*, const char*) const {}
    void raw(const char* key, YAML::Node&, const char* text) { add(key, json::object(), text); }

    template <class Struct>
    static json of() {
        FieldSchema inner;
        Struct value;
        fields(inner, value);
        return inner.schema();
    }

  private:
    static json word() { return {{"type", "string"}, {"minLength", 1}}; }
    static json pairs(const Columns& columns) {
        const json both = json::array({bounded("number", columns.x), bounded("number", columns.y)});
        const json pair = {{"type", "array"}, {"items", both}, {"minItems", 2}, {"maxItems", 2}};
        return {{"type", "array"}, {"items", pair}, {"minItems", 2}};
    }
    static json bounded(const char* type, const Rule& rule) {
        json result = {{"type", type}};
        if (std::isfinite(rule.minimum))
            result[rule.minimum_excluded ? "exclusiveMinimum" : "minimum"] = rule.minimum;
        if (std::isfinite(rule.maximum)) result["maximum"] = rule.maximum;
        if (rule.zero_excluded) result["not"] = {{"const", 0}};
        return result;
    }
    void add(const char* key, json property, const char* text) {
        property["description"] = text;
        properties_[key] = std::move(property);
    }
    void require(const char* key, json property, const char* text) {
        add(key, std::move(property), text);
        required_.push_back(key);
    }

    json properties_ = json::object(), required_ = json::array();
    json signals_;  // pattern of free keys; null: none
    std::vector<json> alternatives_;
};

}  // namespace shiftrig::io
