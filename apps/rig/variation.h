// What a fork varies from branch to branch, as a user writes it:
//
//     clutch.F3.leak=0,0.05,0.1                  these values
//     environment.mobility_number=40:60          anything between, drawn at random
//     calibration.shift.inertia_time_s=0.1:0.4:7 seven values, equally spaced
//     model.masses.vehicle.mass_kg=+-10%         around what it is
//
// A name is a signal that a scenario may set (with its unit's suffix), or a key of the controller's calibration file or
// of the model file, in the units of that file.
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace shiftrig::rig {

struct Variation {
    enum class Target { signal, calibration, model };
    std::string name;  // as written, without the prefix `calibration.` or `model.`
    Target target = Target::signal;
    std::vector<double> values;  // discrete ones; empty: anything from low to high
    double low = 0, high = 0;
    bool relative = false;  // factors of what it is
};

// "calibration.shift.fill_time_s"
std::string full_name(const Variation& v);

// Throws InputError: one clear line.
Variation parse_variation(const std::string& text);

// Which values a branch has. Discrete variations alone give every combination once; where one is drawn at random, so
// are all, from numbers that depend on the seed and the branch alone.
class Plan {
  public:
    Plan(std::vector<Variation> variations, std::int64_t branches, std::uint64_t seed);
    std::int64_t branches() const noexcept { return branches_; }
    const std::vector<Variation>& variations() const noexcept { return variations_; }
    std::vector<double> values(std::int64_t branch) const;

  private:
    std::vector<Variation> variations_;
    std::int64_t branches_;
    std::uint64_t seed_;
    bool random_;
};

// A YAML document with numbers replaced, merge keys resolved; read once, varied as often as wanted.
class YamlVariant {
  public:
    YamlVariant(const std::string& text, const std::string& path);
    // The number at `key` ("shift.inertia_time_s"). `relative`: times what it is in the document. Throws InputError if there
    // is no number.
    void set(const std::string& key, double value, bool relative);
    const YAML::Node& root() const noexcept { return root_; }
    std::string text() const;

  private:
    std::string path_;
    YAML::Node root_;
    std::map<std::string, double> original_;  // of what has been replaced
};

}  // namespace shiftrig::rig
