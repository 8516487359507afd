// One device under examination, so that the rules for its parameters read as one line each. Internal to plant/.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plant/description.h"

namespace shiftrig::plant {

// As it stands in error lines.
std::string number(double value);

// Each rule throws ModelError naming device, field and rule where it does not hold; a value that is not finite holds none.
class Check {
  public:
    Check(std::string_view kind, const std::string& name);
    [[noreturn]] void fail(const std::string& field, const std::string& rule) const;
    void positive(const char* field, double value) const { rule(field, value, value > 0, "> 0"); }
    void not_negative(const char* field, double value) const { rule(field, value, value >= 0, ">= 0"); }
    void not_zero(const char* field, double value) const {
        rule(field, value, value != 0, "different from 0");
    }
    void share(const char* field, double value) const {
        rule(field, value, value > 0 && value <= 1, "in (0, 1]");
    }
    void within(const char* field, double value, double least, double most) const {
        rule(field, value, value >= least && value <= most,
             ("within " + number(least) + " and " + number(most)).c_str());
    }
    void any(const char* field, double value) const { rule(field, value, true, "finite"); }
    // Two points at least, the first column strictly rising.
    void rising(const char* field, const std::vector<std::pair<double, double>>& table) const;
    void waveform(const char* field, const Waveform& waveform) const;

  private:
    void rule(const char* field, double value, bool holds, const char* text) const;
    std::string kind_, name_;
};

}  // namespace shiftrig::plant
