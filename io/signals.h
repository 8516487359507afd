// The table of everything that has a name: plant inputs, plant outputs and the rig's own signals
// (driver's lever, status of messages, loop health). Built once at start; CAN and LCM mappings,
// recordings and scenarios hold indices into it, so that a tick touches one flat array of doubles.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "io/rule.h"
#include "plant/signal.h"

namespace shiftrig::io {

// What somebody may set this signal to, in a unit of `factor` SI units.
Rule rule_of(const plant::Signal& signal, double factor = 1);

class SignalTable {
  public:
    // Returns the index; the value starts at signal.initial. Names are unique: throws std::invalid_argument.
    int add(const plant::Signal& signal);
    int find(std::string_view name) const noexcept;  // −1 if there is none
    const plant::Signal& signal(int index) const { return signals_.at(static_cast<std::size_t>(index)); }
    int size() const noexcept { return static_cast<int>(signals_.size()); }
    // The names nearest to a misspelt one, for error messages.
    std::vector<std::string> nearest(std::string_view name, int count = 3) const;

    std::vector<double> value;  // by index, in the signal's unit

  private:
    std::vector<plant::Signal> signals_;
    std::map<std::string, int, std::less<>> index_;
};

}  // namespace shiftrig::io
