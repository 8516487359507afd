// A Structure under construction: what connectors put themselves into (connectors/connector.h). Internal to plant/.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "plant/structure.h"

namespace shiftrig::plant {

class Assembly {
  public:
    explicit Assembly(const Description& description);

    Structure structure;

    // Index of a mass that is there.
    int mass(const std::string& name) const { return structure.mass(name); }
    // One entry of a column; an empty name is the housing.
    Link link(const std::string& name, double factor) const {
        return name.empty() ? Link{} : Link{structure.mass(name), factor};
    }
    std::array<Link, 2> between(const std::string& a, const std::string& b) const {
        return {link(a, 1), link(b, -1)};
    }
    // Something resists the motion of a body, nominally with this force [N]; whatever does so on one body becomes one
    // friction pair, since they hold it at rest together.
    void resist(const std::string& body, double force);

    // Once all connectors are in.
    Structure finish();  // to be called once

  private:
    std::vector<std::optional<double>> resistance_;  // per mass [N]
};

}  // namespace shiftrig::plant
